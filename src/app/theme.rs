//! The look of the window: egui's style from our palette.

use egui::{Color32, CornerRadius, FontFamily, FontId, Stroke, TextStyle, Visuals};
use palpate_geometry::palette::{Rgb, Theme};

/// A palette colour for egui.
pub(super) fn colour(Rgb(r, g, b): Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// A palette colour with an opacity, 0 to 1.
pub(super) fn veil(Rgb(r, g, b): Rgb, opacity: f32) -> Color32 {
    Color32::from_rgba_unmultiplied(r, g, b, (opacity.clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// Theme in which a part of the window is drawn.
pub(super) fn of(ui: &egui::Ui) -> Theme {
    if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light }
}

/// Fill of the button that a panel proposes.
pub(super) fn accented(theme: Theme) -> Color32 {
    let colours = theme.colours();
    colour(colours.raised.mix(colours.accent, 0.35))
}

/// Gives the window its fonts: those of egui, and another for characters that they lack, as the minus of "m⁻¹".
pub(super) fn install_fonts(ctx: &egui::Context) {
    let mut fonts = egui::FontDefinitions::default();
    fonts.families.entry(FontFamily::Proportional).or_default().push("Hack".to_owned());
    ctx.set_fonts(fonts);
}

/// Applies a theme to the whole window.
pub(super) fn apply(ctx: &egui::Context, theme: Theme) {
    ctx.set_theme(match theme {
        Theme::Dark => egui::Theme::Dark,
        Theme::Light => egui::Theme::Light,
    });
    ctx.all_styles_mut(|style| {
        let font = |size: f32| FontId::new(size, FontFamily::Proportional);
        // Three sizes of one family.
        style.text_styles = [
            (TextStyle::Small, font(11.5)),
            (TextStyle::Body, font(13.5)),
            (TextStyle::Button, font(13.5)),
            (TextStyle::Monospace, FontId::new(12.5, FontFamily::Monospace)),
            (TextStyle::Heading, font(16.0)),
        ]
        .into();
        style.spacing.item_spacing = egui::vec2(8.0, 6.0);
        style.spacing.button_padding = egui::vec2(8.0, 4.0);
        style.spacing.interact_size.y = 24.0;
        style.spacing.slider_width = 120.0;
        // Contents end beside the scroll bar, not below it.
        style.spacing.scroll.floating_allocated_width = 8.0;
        // Seen wherever there is more.
        style.spacing.scroll.dormant_handle_opacity = 0.5;
        style.animation_time = 0.1;
    });
    for each in Theme::ALL {
        let which = match each {
            Theme::Dark => egui::Theme::Dark,
            Theme::Light => egui::Theme::Light,
        };
        ctx.set_visuals_of(which, visuals(each));
    }
}

fn visuals(theme: Theme) -> Visuals {
    let c = theme.colours();
    let mut v = match theme {
        Theme::Dark => Visuals::dark(),
        Theme::Light => Visuals::light(),
    };
    let rounded = CornerRadius::same(4);
    v.panel_fill = colour(c.background);
    v.window_fill = colour(c.raised);
    v.window_stroke = Stroke::new(1.0, colour(c.border));
    v.window_corner_radius = CornerRadius::same(6);
    v.faint_bg_color = colour(c.raised);
    v.extreme_bg_color = colour(c.background.mix(c.raised, 0.35));
    v.hyperlink_color = colour(c.accent);
    v.warn_fg_color = colour(c.warning);
    v.error_fg_color = colour(c.error);
    v.weak_text_color = Some(colour(c.quiet_text));
    v.selection.bg_fill = colour(c.background.mix(c.accent, 0.35));
    v.selection.stroke = Stroke::new(1.0, colour(c.text));
    let widgets = &mut v.widgets;
    let levels = [
        (&mut widgets.noninteractive, 0.0, c.text),
        (&mut widgets.inactive, 0.10, c.text),
        (&mut widgets.hovered, 0.20, c.text),
        (&mut widgets.active, 0.30, c.text),
        (&mut widgets.open, 0.16, c.text),
    ];
    for (widget, lift, text) in levels {
        let fill = colour(c.raised.mix(c.text, lift));
        widget.corner_radius = rounded;
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.bg_stroke = Stroke::new(1.0, colour(c.border));
        widget.fg_stroke = Stroke::new(1.2, colour(text));
        widget.expansion = 0.0;
    }
    v.widgets.noninteractive.bg_fill = colour(c.background);
    v.widgets.hovered.bg_stroke = Stroke::new(1.0, colour(c.quiet_text));
    v
}
