//! The sixteen, one function each. Millimetres in the text, metres in the meshes.

use super::tools::{Parts, at, disc, facing, lying, ribbon, sticker, turned, turned_soft};
use super::{Body, Thing};
use glam::{DVec2, DVec3};
use palpate_geometry::{Pose, Primitive, TriMesh, cube_sphere, rounded_box};
use palpate_sim::objects::{ShapeClass, SizeClass};
use palpate_geometry::palette::Rgb;
use std::f64::consts::{FRAC_PI_2, TAU};

/// All of them, in order of name.
pub(super) fn all() -> Vec<Thing> {
    vec![
        ball(),
        bigball(),
        cardboard_box(),
        button(),
        case(),
        cube(),
        cylinder(),
        jenga(),
        labello(),
        lemon(),
        metalbrick(),
        parallelepiped(),
        smallbutton(),
        smallcube(),
        syringe(),
        tomato(),
    ]
}

fn mm(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z) * 1e-3
}

/// A box-shaped thing of edges x, y, z (mm).
fn block(x: f64, y: f64, z: f64) -> Body {
    let half = mm(x, y, z) * 0.5;
    Body::Primitives(vec![(Primitive::Cuboid { half }, [0.0; 3], [0.0; 3])])
}

fn sphere(radius_mm: f64) -> Body {
    Body::Primitives(vec![(Primitive::Sphere { radius: radius_mm * 1e-3 }, [0.0; 3], [0.0; 3])])
}

/// A cylinder lying along y: its middle at y, its radius and length (mm).
fn lying_cylinder(y: f64, radius: f64, length: f64) -> (Primitive, [f64; 3], [f64; 3]) {
    let shape = Primitive::Cylinder { radius: radius * 1e-3, half_length: 0.5e-3 * length };
    (shape, [0.0, y * 1e-3, 0.0], [-FRAC_PI_2, 0.0, 0.0])
}

fn scaled(mut mesh: TriMesh, x: f64, y: f64, z: f64) -> TriMesh {
    mesh.scale(mm(x, y, z));
    mesh
}

/// A rubber ball, 40 mm, with a white band.
fn ball() -> Thing {
    let mut look = Parts::default();
    let mesh = scaled(cube_sphere(24), 20.0, 20.0, 20.0);
    look.add("rubber", Rgb(206, 58, 52), mesh);
    let circle: Vec<DVec3> = (0..96).map(|k| DVec2::from_angle(TAU * f64::from(k) / 96.0).extend(0.0)).collect();
    look.add("band", Rgb(240, 236, 228), ribbon(&circle, 0.02002, 0.007));
    Thing {
        name: "ball",
        title: "Rubber ball",
        size: SizeClass::Tiny,
        shape: ShapeClass::Spherical,
        mass: 0.032,
        friction: 0.8,
        look,
        body: sphere(20.0),
    }
}

/// A tennis ball, 65 mm, with its seam.
fn bigball() -> Thing {
    let mut look = Parts::default();
    look.add("felt", Rgb(203, 219, 62), scaled(cube_sphere(28), 32.5, 32.5, 32.5));
    let seam: Vec<DVec3> = (0..240)
        .map(|k| {
            let t = TAU * f64::from(k) / 240.0;
            let (a, b) = (0.75, 0.25);
            DVec3::new(
                a * t.cos() + b * (3.0 * t).cos(),
                a * t.sin() - b * (3.0 * t).sin(),
                2.0 * (a * b).sqrt() * (2.0 * t).sin(),
            )
            .normalize()
        })
        .collect();
    look.add("seam", Rgb(244, 244, 238), ribbon(&seam, 0.03253, 0.0024));
    Thing {
        name: "bigball",
        title: "Tennis ball",
        size: SizeClass::Large,
        shape: ShapeClass::Spherical,
        mass: 0.057,
        friction: 0.7,
        look,
        body: sphere(32.5),
    }
}

/// A cardboard box, 80 x 50 x 40 mm, taped shut.
fn cardboard_box() -> Thing {
    let mut look = Parts::default();
    look.add("cardboard", Rgb(190, 146, 98), rounded_box(mm(25.0, 40.0, 20.0), 0.0008));
    let tape = Rgb(222, 199, 158);
    let lift = 0.05;
    look.add("tape", tape, at(sticker(DVec2::new(0.0075, 0.0396), 0.0001), mm(0.0, 0.0, 20.0 + lift)));
    for side in [-1.0, 1.0] {
        let flap = sticker(DVec2::new(0.0075, 0.006), 0.0001);
        look.add("tape", tape, facing(flap, DVec3::Y * side, mm(0.0, side * (40.0 + lift), 14.0)));
        // The gap between the flaps shows on both sides of the tape.
        let label = sticker(DVec2::new(0.0105, 0.014), 0.001);
        look.add("label", Rgb(238, 236, 230), facing(label, DVec3::X * side, mm(side * (25.0 + lift), 6.0, 0.0)));
        for line in 0..3 {
            let bar = sticker(DVec2::new(0.0007, 0.009), 0.0003);
            let z = 5.0 - 4.0 * f64::from(line);
            let place = mm(side * (25.0 + 2.0 * lift), 6.0, z);
            look.add("print", Rgb(70, 74, 80), facing(bar, DVec3::X * side, place));
        }
    }
    Thing {
        name: "box",
        title: "Cardboard box",
        size: SizeClass::Large,
        shape: ShapeClass::Cubic,
        mass: 0.048,
        friction: 0.6,
        look,
        body: block(50.0, 80.0, 40.0),
    }
}

/// An emergency-stop button, 40 mm across, 28 mm high.
fn button() -> Thing {
    let mut look = Parts::default();
    let base = turned_soft(&[(0.0, -14.0), (20.0, -14.0), (20.0, 0.0), (13.0, 2.0), (0.0, 2.0)], 1.4);
    look.add("housing", Rgb(238, 190, 44), base);
    let neck = turned(&[(0.0, 1.5), (12.0, 1.5), (12.0, 5.0), (0.0, 5.0)]);
    look.add("neck", Rgb(58, 60, 64), neck);
    let cap = turned_soft(&[(0.0, 4.0), (17.5, 4.0), (18.0, 9.0), (13.0, 13.4), (0.0, 14.0)], 3.0);
    look.add("cap", Rgb(200, 40, 38), cap);
    look.add("mark", Rgb(240, 236, 228), at(ring(0.0068, 0.0080), mm(0.0, 0.0, 13.9)));
    let silhouette = turned_soft(
        &[
            (0.0, -14.0),
            (20.0, -14.0),
            (20.0, 0.0),
            (13.0, 2.0),
            (12.0, 4.0),
            (17.5, 4.2),
            (18.0, 9.0),
            (13.0, 13.4),
            (0.0, 14.0),
        ],
        1.4,
    );
    Thing {
        name: "button",
        title: "Stop button",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cylindrical,
        mass: 0.036,
        friction: 0.5,
        look,
        body: Body::Mesh(silhouette),
    }
}

/// A push button, 20 mm across, 12 mm high.
fn smallbutton() -> Thing {
    let mut look = Parts::default();
    let bezel = turned_soft(&[(0.0, -6.0), (10.0, -6.0), (10.0, 0.5), (8.4, 1.5), (0.0, 1.5)], 0.7);
    look.add("bezel", Rgb(62, 66, 72), bezel);
    let cap = turned_soft(&[(0.0, 1.0), (7.6, 1.0), (7.6, 5.0), (5.0, 6.0), (0.0, 6.0)], 1.2);
    look.add("cap", Rgb(46, 150, 92), cap);
    let silhouette =
        turned_soft(&[(0.0, -6.0), (10.0, -6.0), (10.0, 0.5), (8.0, 1.5), (7.6, 5.0), (5.0, 6.0), (0.0, 6.0)], 0.7);
    Thing {
        name: "smallbutton",
        title: "Push button",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cylindrical,
        mass: 0.0045,
        friction: 0.5,
        look,
        body: Body::Mesh(silhouette),
    }
}

/// A flat ring facing z (m).
fn ring(inner: f64, outer: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    for k in 0..48u32 {
        let direction = DVec2::from_angle(TAU * f64::from(k) / 48.0);
        mesh.points.push((direction * inner).extend(0.0));
        mesh.points.push((direction * outer).extend(0.0));
        let (a, b) = (2 * k, 2 * ((k + 1) % 48));
        mesh.triangles.push([a, a + 1, b + 1]);
        mesh.triangles.push([a, b + 1, b]);
    }
    mesh
}

/// A rounded case for earphones, 58 x 46 x 22 mm.
fn case() -> Thing {
    let mut look = Parts::default();
    let shell = rounded_box(mm(23.0, 29.0, 11.0), 0.0100);
    look.add("shell", Rgb(232, 232, 230), shell.clone());
    // The seam of the lid, a light, and a hinge.
    let mut seam = TriMesh::default();
    let outline = seam_outline(mm(23.03, 29.03, 11.0), 0.0100);
    let n = outline.len() as u32;
    for p in &outline {
        seam.points.push(p.extend(0.0034));
        seam.points.push(p.extend(0.0039));
    }
    for k in 0..n {
        let (a, b) = (2 * k, 2 * ((k + 1) % n));
        seam.triangles.push([a, b, b + 1]);
        seam.triangles.push([a, b + 1, a + 1]);
    }
    look.add("seam", Rgb(120, 122, 124), seam);
    look.add("light", Rgb(64, 176, 98), facing(disc(0.0009), DVec3::X, mm(23.05, 0.0, -1.5)));
    let hinge = sticker(DVec2::new(0.0012, 0.009), 0.0006);
    look.add("hinge", Rgb(172, 174, 176), facing(hinge, DVec3::NEG_X, mm(-23.05, 0.0, 3.6)));
    Thing {
        name: "case",
        title: "Earphone case",
        size: SizeClass::Large,
        shape: ShapeClass::Cubic,
        mass: 0.046,
        friction: 0.45,
        look,
        body: Body::Mesh(shell),
    }
}

/// Outline of a rounded box seen from above, counter-clockwise (m).
fn seam_outline(half: DVec3, radius: f64) -> Vec<DVec2> {
    let corner = |sx: f64, sy: f64, from: f64| {
        (0..=8).map(move |k| {
            let angle = 0.25 * TAU * (from + f64::from(k) / 8.0);
            DVec2::new(sx * (half.x - radius), sy * (half.y - radius)) + DVec2::from_angle(angle) * radius
        })
    };
    corner(1.0, 1.0, 0.0)
        .chain(corner(-1.0, 1.0, 1.0))
        .chain(corner(-1.0, -1.0, 2.0))
        .chain(corner(1.0, -1.0, 3.0))
        .collect()
}

/// A puzzle cube, 45 mm.
fn cube() -> Thing {
    let mut look = Parts::default();
    look.add("body", Rgb(34, 36, 40), rounded_box(mm(22.5, 22.5, 22.5), 0.0016));
    let faces = [
        (DVec3::X, "red", Rgb(196, 44, 44)),
        (DVec3::NEG_X, "orange", Rgb(236, 128, 38)),
        (DVec3::Y, "blue", Rgb(42, 92, 178)),
        (DVec3::NEG_Y, "green", Rgb(44, 150, 82)),
        (DVec3::Z, "white", Rgb(240, 240, 236)),
        (DVec3::NEG_Z, "yellow", Rgb(240, 208, 62)),
    ];
    for (out, name, colour) in faces {
        let (u, v) = if out.z.abs() > 0.5 { (DVec3::X, DVec3::Y) } else { (DVec3::Z, out.cross(DVec3::Z)) };
        for i in -1..=1 {
            for j in -1..=1 {
                let place = out * 0.02255 + (u * f64::from(i) + v * f64::from(j)) * 0.0147;
                look.add(name, colour, facing(sticker(DVec2::splat(0.0064), 0.0014), out, place));
            }
        }
    }
    Thing {
        name: "cube",
        title: "Puzzle cube",
        size: SizeClass::Large,
        shape: ShapeClass::Cubic,
        mass: 0.062,
        friction: 0.5,
        look,
        body: block(45.0, 45.0, 45.0),
    }
}

/// A tin, 35 mm across, 60 mm high.
fn cylinder() -> Thing {
    let mut look = Parts::default();
    let tin = turned(&[
        (0.0, -28.6),
        (16.2, -28.6),
        (16.4, -30.0),
        (17.5, -30.0),
        (17.5, -28.2),
        (17.2, -27.6),
        (17.2, 27.6),
        (17.5, 28.2),
        (17.5, 30.0),
        (16.4, 30.0),
        (16.2, 28.6),
        (0.0, 28.6),
    ]);
    look.add("tin", Rgb(196, 200, 204), tin);
    let band = |from: f64, to: f64| turned(&[(0.0, from), (17.35, from), (17.35, to), (0.0, to)]);
    look.add("label", Rgb(36, 104, 140), band(-25.0, 25.0));
    let stripe = |from: f64, to: f64| turned(&[(0.0, from), (17.42, from), (17.42, to), (0.0, to)]);
    look.add("stripe", Rgb(240, 232, 210), stripe(-9.0, 9.0));
    look.add("line", Rgb(214, 142, 48), stripe(12.0, 14.0));
    look.add("line", Rgb(214, 142, 48), stripe(-14.0, -12.0));
    let shape = Primitive::Cylinder { radius: 0.0175, half_length: 0.030 };
    Thing {
        name: "cylinder",
        title: "Tin",
        size: SizeClass::Large,
        shape: ShapeClass::Cylindrical,
        mass: 0.058,
        friction: 0.5,
        look,
        body: Body::Primitives(vec![(shape, [0.0; 3], [0.0; 3])]),
    }
}

/// Tones of pale wood: light, middle, dark.
const WOOD: [(&str, Rgb); 3] =
    [("wood light", Rgb(226, 194, 146)), ("wood", Rgb(214, 178, 128)), ("wood dark", Rgb(200, 160, 110))];

/// A sheet of wood grain facing z, `half` (m): strips along y whose borders waver, in tones that alternate.
fn add_grain(look: &mut Parts, half: DVec2, seed: f64, place: impl Fn(TriMesh) -> TriMesh) {
    const STRIPS: u32 = 9;
    const STEPS: u32 = 24;
    let border = |strip: u32, y: f64| {
        if strip == 0 || strip == STRIPS {
            return if strip == 0 { -half.x } else { half.x };
        }
        let k = f64::from(strip);
        let even = 2.0 * k / f64::from(STRIPS) - 1.0 + 0.06 * (seed + 5.1 * k).sin();
        let wave = 0.035 * (55.0 * y + seed + 0.8 * k).sin() + 0.02 * (131.0 * y + 2.0 * seed + k).sin();
        half.x * (even + wave).clamp(-0.99, 0.99)
    };
    for strip in 0..STRIPS {
        let mut mesh = TriMesh::default();
        for step in 0..=STEPS {
            let y = half.y * (2.0 * f64::from(step) / f64::from(STEPS) - 1.0);
            mesh.points.push(DVec3::new(border(strip, y), y, 0.0));
            mesh.points.push(DVec3::new(border(strip + 1, y), y, 0.0));
        }
        for step in 0..STEPS {
            let a = 2 * step;
            mesh.triangles.push([a, a + 1, a + 3]);
            mesh.triangles.push([a, a + 3, a + 2]);
        }
        let tone = ((seed + 2.7 * f64::from(strip)).sin() * 1.45 + 1.5) as usize;
        let (name, colour) = WOOD[tone.min(2)];
        look.add(name, colour, place(mesh));
    }
}

/// A wooden tower block, 75 x 25 x 15 mm.
fn jenga() -> Thing {
    let mut look = Parts::default();
    let (x, y, z) = (12.5e-3, 37.5e-3, 7.5e-3);
    look.add("wood", WOOD[1].1, rounded_box(DVec3::new(x, y, z), 0.0008));
    let (inset, lift) = (0.0007, 3e-5);
    for (out, half, at_distance, seed) in [
        (DVec3::Z, DVec2::new(x, y), z, 0.4),
        (DVec3::NEG_Z, DVec2::new(x, y), z, 2.3),
        (DVec3::X, DVec2::new(z, y), x, 4.1),
        (DVec3::NEG_X, DVec2::new(z, y), x, 1.2),
    ] {
        // Turning z to +-x or -z about y keeps the grain along y.
        let turn = DVec3::new(0.0, out.x.atan2(out.z), 0.0);
        let pose = Pose::from_xyz_rpy(out * (at_distance + lift), turn);
        add_grain(&mut look, half - DVec2::splat(inset), seed, |mut mesh| {
            mesh.transform(&pose);
            mesh
        });
    }
    for side in [-1.0, 1.0] {
        for (k, radius) in [0.004, 0.008, 0.012, 0.016].into_iter().enumerate() {
            let arc = growth_ring(radius, DVec2::new(x - inset, z - inset));
            let place = DVec3::Y * side * (y + lift * (1.0 + k as f64));
            look.add("wood dark", WOOD[2].1, facing(arc, DVec3::Y * side, place));
        }
    }
    Thing {
        name: "jenga",
        title: "Tower block",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cubic,
        mass: 0.019,
        friction: 0.55,
        look,
        body: block(25.0, 75.0, 15.0),
    }
}

/// The part of a growth ring about a point below the end face that lies within `half` (m), facing z.
fn growth_ring(radius: f64, half: DVec2) -> TriMesh {
    let centre = DVec2::new(0.3 * half.x, -1.1 * half.y);
    let mut mesh = TriMesh::default();
    let points: Vec<(DVec2, DVec2)> = (0..=40)
        .map(|k| DVec2::from_angle(std::f64::consts::PI * f64::from(k) / 40.0))
        .map(|d| (centre + d * (radius - 0.0003), centre + d * (radius + 0.0003)))
        .collect();
    for pair in points.windows(2) {
        let quad = [pair[0].0, pair[0].1, pair[1].1, pair[1].0];
        if quad.iter().all(|p| p.abs().cmple(half).all()) {
            let from = mesh.points.len() as u32;
            mesh.points.extend(quad.map(|p| p.extend(0.0)));
            mesh.triangles.extend([[from, from + 1, from + 2], [from, from + 2, from + 3]]);
        }
    }
    mesh
}

/// A stick of lip balm, 18 mm across, 68 mm long, lying.
fn labello() -> Thing {
    let mut look = Parts::default();
    let part = |profile: &[(f64, f64)]| lying(turned_soft(profile, 0.9));
    look.add("body", Rgb(28, 66, 140), part(&[(0.0, -32.0), (8.4, -32.0), (8.4, 6.0), (0.0, 6.0)]));
    look.add("foot", Rgb(232, 234, 238), part(&[(0.0, -34.0), (9.0, -34.0), (9.0, -29.5), (0.0, -29.5)]));
    look.add("band", Rgb(232, 234, 238), part(&[(0.0, 4.0), (8.9, 4.0), (8.9, 7.0), (0.0, 7.0)]));
    look.add("cap", Rgb(38, 86, 172), part(&[(0.0, 7.0), (9.0, 7.0), (9.0, 34.0), (0.0, 34.0)]));
    look.add("line", Rgb(120, 176, 226), lying(turned(&[(0.0, -14.0), (8.46, -14.0), (8.46, -10.0), (0.0, -10.0)])));
    Thing {
        name: "labello",
        title: "Lip balm",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cylindrical,
        mass: 0.014,
        friction: 0.45,
        look,
        body: Body::Primitives(vec![lying_cylinder(0.0, 9.0, 68.0)]),
    }
}

/// A lemon, 58 x 45 mm, lying.
fn lemon() -> Thing {
    // Radius over the long axis: an ellipse that runs out into a nub at either end.
    let profile: Vec<(f64, f64)> = (0..=60)
        .map(|k| {
            let s = f64::from(k) / 30.0 - 1.0;
            let body = 22.5 * (1.0 - (s / 0.93).powi(2)).max(0.0).powf(0.52);
            let nub = 4.2 * (1.0 - ((s.abs() - 0.86) / 0.14).max(0.0).powi(2)).max(0.0).sqrt();
            (body.max(nub), 29.0 * s)
        })
        .collect();
    let mut closed = vec![(0.0, profile[0].1)];
    closed.extend(profile.iter().filter(|(r, _)| *r > 0.05));
    closed.push((0.0, profile[profile.len() - 1].1));
    let skin = lying(turned(&closed));
    let mut look = Parts::default();
    let materials = [("skin", Rgb(242, 206, 46)), ("tip", Rgb(196, 190, 62)), ("stem", Rgb(118, 122, 54))];
    look.add_painted(&skin, &materials, |p| {
        let radius = DVec2::new(p.x, p.z).length();
        match p.y {
            y if y > 0.0286 && radius < 0.0026 => 2,
            y if y > 0.0272 => 1,
            _ => 0,
        }
    });
    Thing {
        name: "lemon",
        title: "Lemon",
        size: SizeClass::Large,
        shape: ShapeClass::Spherical,
        mass: 0.058,
        friction: 0.5,
        look,
        body: Body::Mesh(skin),
    }
}

/// A steel brick, 60 x 30 x 12 mm.
fn metalbrick() -> Thing {
    let mut look = Parts::default();
    look.add("steel", Rgb(150, 156, 164), rounded_box(mm(15.0, 30.0, 6.0), 0.0010));
    let plate = sticker(DVec2::new(0.0105, 0.0245), 0.001);
    look.add("milled", Rgb(172, 178, 186), at(plate, mm(0.0, 0.0, 6.04)));
    for (x, y) in [(-7.5, -21.5), (7.5, -21.5), (-7.5, 21.5), (7.5, 21.5)] {
        look.add("bore", Rgb(70, 74, 80), at(disc(0.0018), mm(x, y, 6.08)));
    }
    Thing {
        name: "metalbrick",
        title: "Steel brick",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cubic,
        mass: 0.168,
        friction: 0.35,
        look,
        body: block(30.0, 60.0, 12.0),
    }
}

/// A painted toy block, 60 x 30 x 30 mm, with bare wooden ends.
fn parallelepiped() -> Thing {
    let mut look = Parts::default();
    look.add("paint", Rgb(42, 138, 140), rounded_box(mm(15.0, 30.0, 15.0), 0.0015));
    for side in [-1.0, 1.0] {
        let end = sticker(DVec2::splat(0.0132), 0.0012);
        look.add("wood", Rgb(218, 184, 134), facing(end, DVec3::Y * side, mm(0.0, side * 30.04, 0.0)));
        for (radius, dark) in [(0.0095, 204u8), (0.0060, 196), (0.0028, 186)] {
            let place = mm(2.0, side * (30.05 + 0.02 * f64::from(205 - dark)), -1.5);
            let name = format!("ring {dark}");
            look.add(
                &name,
                Rgb(dark, dark - 38, dark - 90),
                facing(ring(radius - 0.0005, radius), DVec3::Y * side, place),
            );
        }
    }
    Thing {
        name: "parallelepiped",
        title: "Toy block",
        size: SizeClass::Large,
        shape: ShapeClass::Cubic,
        mass: 0.034,
        friction: 0.55,
        look,
        body: block(30.0, 60.0, 30.0),
    }
}

/// A die, 20 mm.
fn smallcube() -> Thing {
    let mut look = Parts::default();
    look.add("ivory", Rgb(240, 236, 224), rounded_box(mm(10.0, 10.0, 10.0), 0.0020));
    let faces = [(DVec3::Z, 1), (DVec3::NEG_Z, 6), (DVec3::X, 2), (DVec3::NEG_X, 5), (DVec3::Y, 3), (DVec3::NEG_Y, 4)];
    for (out, pips) in faces {
        let u = if out.z.abs() > 0.5 { DVec3::X } else { DVec3::Z };
        let v = out.cross(u);
        let places: &[(f64, f64)] = match pips {
            1 => &[(0.0, 0.0)],
            2 => &[(-1.0, -1.0), (1.0, 1.0)],
            3 => &[(-1.0, -1.0), (0.0, 0.0), (1.0, 1.0)],
            4 => &[(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)],
            5 => &[(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 0.0)],
            _ => &[(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 0.0), (1.0, 0.0)],
        };
        for (a, b) in places {
            let place = out * 0.01004 + (u * *a + v * *b) * 0.0047;
            look.add("pip", Rgb(40, 42, 48), facing(disc(0.0016), out, place));
        }
    }
    Thing {
        name: "smallcube",
        title: "Die",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cubic,
        mass: 0.0092,
        friction: 0.5,
        look,
        body: block(20.0, 20.0, 20.0),
    }
}

/// A syringe, 16 mm across its flanges, 95 mm long, lying.
fn syringe() -> Thing {
    let mut look = Parts::default();
    let part = |profile: &[(f64, f64)]| lying(turned_soft(profile, 0.6));
    look.add("barrel", Rgb(206, 222, 230), part(&[(0.0, -34.0), (6.8, -34.0), (6.8, 18.0), (0.0, 18.0)]));
    look.add("flange", Rgb(190, 208, 218), part(&[(0.0, 17.0), (8.0, 17.0), (8.0, 19.4), (0.0, 19.4)]));
    look.add("rod", Rgb(238, 240, 242), part(&[(0.0, 19.0), (3.6, 19.0), (3.6, 45.5), (0.0, 45.5)]));
    look.add("thumb", Rgb(238, 240, 242), part(&[(0.0, 45.0), (7.6, 45.0), (7.6, 47.5), (0.0, 47.5)]));
    look.add("shoulder", Rgb(190, 208, 218), part(&[(0.0, -37.0), (2.6, -37.0), (6.8, -33.5), (0.0, -33.5)]));
    look.add("cap", Rgb(226, 112, 40), part(&[(0.0, -47.5), (1.6, -47.5), (2.9, -36.5), (0.0, -36.5)]));
    let band = |from: f64, to: f64| lying(turned(&[(0.0, from), (6.86, from), (6.86, to), (0.0, to)]));
    look.add("seal", Rgb(64, 68, 74), band(-8.0, -3.5));
    for k in 0..7 {
        let y = -30.0 + 3.0 * f64::from(k);
        look.add("scale", Rgb(58, 84, 120), band(y, y + 0.35));
    }
    Thing {
        name: "syringe",
        title: "Syringe",
        size: SizeClass::Tiny,
        shape: ShapeClass::Cylindrical,
        mass: 0.011,
        friction: 0.4,
        look,
        body: Body::Primitives(vec![
            lying_cylinder(-8.0, 6.8, 52.0),
            lying_cylinder(18.2, 8.0, 2.4),
            lying_cylinder(32.2, 3.6, 26.5),
            lying_cylinder(46.25, 7.6, 2.5),
            lying_cylinder(-40.5, 2.4, 14.0),
        ]),
    }
}

/// A tomato, 62 mm across, 52 mm high, with its calyx.
fn tomato() -> Thing {
    let mut look = Parts::default();
    let mut flesh = cube_sphere(22);
    for p in &mut flesh.points {
        let around = p.y.atan2(p.x);
        let equator = 1.0 - p.z * p.z;
        // Five shallow lobes, and a dip around the stem and below.
        let lobes = 1.0 - 0.018 * equator * (1.0 - (5.0 * around).cos());
        let dip = |z: f64, depth: f64| depth * (-((1.0 - z) / 0.06)).exp();
        let height = p.z - dip(p.z, 0.14) + dip(-p.z, 0.07);
        *p = DVec3::new(p.x * lobes * 31.0, p.y * lobes * 31.0, height * 27.4) * 1e-3;
    }
    let bounds = flesh.bounds();
    let lift = 0.5 * (bounds.max.z + bounds.min.z);
    for p in &mut flesh.points {
        p.z = (p.z - lift) * 0.052 / bounds.size().z;
    }
    look.add("flesh", Rgb(204, 46, 34), flesh.clone());
    let top = flesh.points.iter().filter(|p| p.truncate().length() < 0.003).map(|p| p.z).fold(0.0, f64::max);
    for k in 0..5 {
        look.add("calyx", Rgb(72, 122, 52), sepal(TAU * f64::from(k) / 5.0 + 0.3, top));
    }
    let stem = at(turned(&[(0.0, -1.0), (1.9, -1.0), (1.4, 3.2), (1.7, 4.0), (0.0, 4.0)]), DVec3::Z * top);
    look.add("stem", Rgb(86, 118, 56), stem);
    Thing {
        name: "tomato",
        title: "Tomato",
        size: SizeClass::Large,
        shape: ShapeClass::Spherical,
        mass: 0.098,
        friction: 0.45,
        look,
        body: Body::Mesh(flesh),
    }
}

/// One leaf of the calyx: a pointed strip that lies over the rim of the dip and droops.
fn sepal(angle: f64, top: f64) -> TriMesh {
    let out = DVec2::from_angle(angle);
    let side = out.perp();
    let mut mesh = TriMesh::default();
    const STEPS: u32 = 8;
    for k in 0..=STEPS {
        let s = f64::from(k) / f64::from(STEPS);
        let reach = 0.001 + 0.0165 * s;
        let height = top + 0.0016 + 0.0042 * (s * std::f64::consts::PI * 0.75).sin() - 0.0012 * s;
        let half_width = 0.0026 * (1.0 - s).powf(0.7) + 1e-5;
        for w in [-1.0, 1.0] {
            mesh.points.push((out * reach + side * (w * half_width)).extend(height));
        }
    }
    for k in 0..STEPS {
        let a = 2 * k;
        mesh.triangles.push([a, a + 2, a + 3]);
        mesh.triangles.push([a, a + 3, a + 1]);
        // Seen from below as well.
        mesh.triangles.push([a, a + 3, a + 2]);
        mesh.triangles.push([a, a + 1, a + 3]);
    }
    mesh
}
