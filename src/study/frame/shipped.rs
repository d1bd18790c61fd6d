//! Results of full runs that come with the program.

/// Files of `assets/studies` by the key of their study.
const SHIPPED: &[(&str, &str)] = &[
    ("signatures", include_str!("../../../assets/studies/paper/signatures.json")),
    ("layouts", include_str!("../../../assets/studies/paper/layouts.json")),
    ("modality", include_str!("../../../assets/studies/paper/modality.json")),
    ("stages", include_str!("../../../assets/studies/paper/stages.json")),
    ("region", include_str!("../../../assets/studies/paper/region.json")),
    ("training-size", include_str!("../../../assets/studies/paper/training-size.json")),
    ("models", include_str!("../../../assets/studies/paper/models.json")),
    ("grasps", include_str!("../../../assets/studies/paper/grasps.json")),
    ("drift", include_str!("../../../assets/studies/paper/drift.json")),
    ("shaking", include_str!("../../../assets/studies/paper/shaking.json")),
    ("recognition", include_str!("../../../assets/studies/paper/recognition.json")),
    ("answers", include_str!("../../../assets/studies/answers.json")),
    ("added-sensors", include_str!("../../../assets/studies/added-sensors.json")),
    ("public", include_str!("../../../assets/studies/public.json")),
    ("accuracy", include_str!("../../../assets/studies/accuracy.json")),
    ("effects", include_str!("../../../assets/studies/effects.json")),
    ("stability", include_str!("../../../assets/studies/stability.json")),
];

/// Result of the full run of a study, as JSON; none where it has not been run in full.
pub(super) fn shipped_json(key: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(own, _)| *own == key).map(|(_, json)| *json)
}
