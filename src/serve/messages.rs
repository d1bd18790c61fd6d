//! Messages, one JSON object a line: requests in, answers and events out.

use palpate_lab::grasping::{GripperMove, IdentificationView};
use palpate_store::labels::FlagRemark;
use palpate_tactile::trial::TrialId;
use schemars::{JsonSchema, schema_for};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Highest pressure that a request may ask for (bar).
const MOST_BAR: f64 = 1.5;
/// Longest recording (s): a day.
const MOST_S: f64 = 86_400.0;
/// Largest move of the emulated gripper: turn (degrees), shift and lift (mm).
const MOST_TURN_DEG: f64 = 180.0;
const MOST_MM: f64 = 50.0;

/// A request as a client sends it.
#[derive(Clone, Debug, JsonSchema)]
pub struct Message {
    /// Anything; the answer repeats it.
    #[schemars(default)]
    pub id: Value,
    /// The token of the server: for `grasp`, `close` and `pressure`, which move air.
    #[schemars(default)]
    pub token: Option<String>,
    /// What is asked for.
    #[schemars(flatten)]
    pub request: Request,
}

/// What a client asks for.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[schemars(tag = "request")]
pub enum Request {
    /// Grasp by the programme of the scene, record and recognise; answered after the release, about seven seconds later.
    Grasp {
        /// Class of the object, where it is known: the label of the trial.
        #[serde(default)]
        object: Option<String>,
        /// The object is that of the last grasp: both count together.
        #[serde(default)]
        again: bool,
    },
    /// Close the fingers and keep them closed.
    Close {
        /// Line pressure (bar); that of the programme where it is not given.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 1.5))]
        bar: Option<f64>,
    },
    /// Let the air out at once, and end the running trial.
    Vent {},
    /// Set the line pressure: it rises at the pace of the programme, falls at once, and stays.
    Pressure {
        /// Line pressure (bar).
        #[schemars(range(min = 0.0, max = 1.5))]
        bar: f64,
    },
    /// Take the present readings as zero. Nothing may touch the fingers.
    Tare {},
    /// Record without driving the fingers; answered with the number of the trial when it begins.
    Record {
        /// Class of the object, where it is known.
        #[serde(default)]
        object: Option<String>,
        /// Length (s); without one, until `end`.
        #[serde(default)]
        #[schemars(range(min = 0.1, max = 86_400.0))]
        seconds: Option<f64>,
        /// End the running trial instead, and keep it.
        #[serde(default)]
        end: bool,
    },
    /// Label a recorded trial.
    Label {
        /// Its number; the last one where it is not given.
        #[serde(default)]
        trial: Option<TrialId>,
        /// Class of the object; `empty` for the empty hand.
        object: String,
        /// The label is unsure.
        #[serde(default)]
        unsure: bool,
    },
    /// What the model makes of the running or last grasp.
    Recognise {},
    /// The move before the next grasp from which most is expected to be learned.
    Advise {},
    /// Put an object into the emulated hand. By a move, the object stays and the next grasp is where that move of the gripper
    /// leads; without one, the object is put down anew.
    Place {
        /// Built-in object, or a file; the present one where it is not given.
        #[serde(default)]
        object: Option<String>,
        /// Move of the gripper since the last grasp.
        #[serde(default, rename = "move")]
        by: Option<GripperPose>,
    },
    /// Send events from now on.
    Subscribe {
        /// Which.
        to: Subscription,
    },
}

/// What can be subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Subscription {
    /// Each sample.
    Rows,
    /// Each new answer of the model.
    Verdict,
    /// Begin and end of each trial.
    Trial,
}

/// A move of the gripper between two grasps: a turn, then a shift in its new frame, and a lift. The object under a gripper that
/// stays moves the other way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GripperPose {
    /// Turn about the vertical, counter-clockwise from above (degrees).
    pub turn_deg: f64,
    /// Shift across the pads, in the direction of closing, and along their width (mm).
    pub shift_mm: [f64; 2],
    /// Lift (mm).
    pub lift_mm: f64,
}

impl From<GripperMove> for GripperPose {
    fn from(by: GripperMove) -> Self {
        let mm = |metres: f64| (1e5 * metres).round() * 1e-2;
        Self { turn_deg: by.turn_deg, shift_mm: by.shift.map(mm), lift_mm: mm(by.lift) }
    }
}

impl GripperPose {
    /// The move in metres.
    pub(crate) fn of_gripper(&self) -> GripperMove {
        let metres = |mm: f64| 1e-3 * mm;
        GripperMove { turn_deg: self.turn_deg, shift: self.shift_mm.map(metres), lift: metres(self.lift_mm) }
    }
}

/// What is wrong with a request.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Fault {
    /// Field at fault, as in `move.turn_deg`; none where it is the whole line, or the gripper.
    pub field: Option<String>,
    /// What is wrong and what to try.
    pub text: String,
}

impl Fault {
    /// A fault of a field.
    pub(crate) fn of(field: &str, text: impl Into<String>) -> Self {
        Self { field: Some(field.to_owned()), text: text.into() }
    }
}

impl From<String> for Fault {
    fn from(text: String) -> Self {
        Self { field: None, text }
    }
}

/// What a client is sent.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Outgoing {
    /// The request is done.
    Answer {
        /// That of the request.
        id: Value,
        /// Its result.
        answer: Answer,
    },
    /// The request is not done.
    Error {
        /// That of the request; null where the line has none.
        id: Value,
        /// What is wrong.
        error: Fault,
    },
    /// Something that was subscribed to.
    Event(Event),
}

impl Outgoing {
    /// An answer or an error.
    pub(crate) fn to(id: Value, outcome: Result<Answer, Fault>) -> Self {
        match outcome {
            Ok(answer) => Self::Answer { id, answer },
            Err(error) => Self::Error { id, error },
        }
    }

    /// The message as a line.
    pub(crate) fn line(&self) -> String {
        // Numbers, texts and maps with text keys can be written.
        let mut line = serde_json::to_string(self).unwrap_or_default();
        line.push('\n');
        line
    }
}

/// Result of a request; fields that say nothing about it are absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Answer {
    /// Trial that was recorded, begun or labelled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trial: Option<TrialId>,
    /// Pressure that the fingers go to (bar).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_bar: Option<f64>,
    /// What the model says; absent where it has read nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<VerdictMessage>,
    /// Advice; absent where no move is known to help.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<Advice>,
    /// Faults found in the trial that has ended; absent where there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub flags: Vec<FlagMessage>,
    /// Remarks, in sentences.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// Fault of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FlagMessage {
    /// `no-contact`, `saturated`, `interrupted`, `cadence` or `sensor-fault`.
    pub flag: String,
    /// Reason with numbers.
    pub text: String,
}

impl From<&FlagRemark> for FlagMessage {
    fn from(found: &FlagRemark) -> Self {
        Self { flag: found.flag.label().replace(' ', "-"), text: found.remark.clone() }
    }
}

/// Advice on the next grasp.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Advice {
    /// What to do with the object, for people.
    pub text: String,
    /// The same as a move of the gripper, which `place` takes.
    #[serde(rename = "move")]
    pub by: GripperPose,
}

/// What the model makes of the grasps of an object.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct VerdictMessage {
    /// Likeliest class.
    pub class: String,
    /// Its probability.
    pub probability: f64,
    /// Probability of each class.
    pub pmf: BTreeMap<String, f64>,
    /// Class, or `unknown`, once the model is sure or the limit of grasps is reached.
    pub decided: Option<String>,
    /// Classes that are left after the finished grasps, by a model with a promise (`palpate promise`).
    pub left: Option<Vec<String>>,
    /// Finished grasps of this object.
    pub grasps: usize,
    /// The fingers close or hold, and the answer still changes.
    pub listening: bool,
}

impl VerdictMessage {
    /// The newest verdict; none before the first readings.
    pub(crate) fn of(view: &IdentificationView) -> Option<Self> {
        let pmf = &view.verdict.as_ref()?.pmf;
        let classes = &view.labels.classes;
        let (class, probability) = pmf.top();
        Some(Self {
            class: classes.get(class)?.name.clone(),
            probability,
            pmf: classes.iter().map(|class| class.name.clone()).zip(pmf.probabilities().iter().copied()).collect(),
            decided: view.decided().map(str::to_owned),
            left: view.left.as_ref().map(|left| {
                classes.iter().zip(left).filter(|(_, left)| **left).map(|(class, _)| class.name.clone()).collect()
            }),
            grasps: view.beliefs.len(),
            listening: view.listening,
        })
    }
}

/// Something that was subscribed to.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A sample.
    Rows {
        /// Number of its stretch: of a grasp, or of the time between two.
        stretch: u64,
        /// Time since the closing, negative before it; outside of grasps, on the clock of the gripper (s).
        t_s: f64,
        /// Line pressure (bar).
        line_bar: Option<f64>,
        /// Value of each channel, in its unit, and counts of the board by column; null where undefined.
        values: BTreeMap<String, Option<f32>>,
    },
    /// A new answer of the model.
    Verdict(VerdictMessage),
    /// A trial has begun or ended.
    Trial {
        /// Its number.
        trial: TrialId,
        /// Which of both.
        state: TrialState,
        /// Class of its object, where it was given.
        object: Option<String>,
        /// Faults found when it ended; absent where there is none.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        flags: Vec<FlagMessage>,
    },
    /// Samples were dropped because they were not read.
    Lost {
        /// How many since the last such message.
        samples: u64,
    },
}

/// State of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TrialState {
    /// It is recorded.
    Begun,
    /// It is stored.
    Ended,
    /// It is stored, and readings or the programme ended early.
    CutShort,
}

/// JSON schema of all messages: `request` is what a client sends, `reply` what it is sent.
pub fn schema() -> Value {
    #[derive(JsonSchema)]
    #[expect(dead_code, reason = "only its schema is needed")]
    struct Messages {
        request: Message,
        reply: Outgoing,
    }
    schema_for!(Messages).to_value()
}

/// Reads a line; on a fault, with the id that the line has.
pub(crate) fn parse(line: &[u8]) -> Result<Message, (Value, Fault)> {
    let read: Result<Map<String, Value>, _> = serde_json::from_slice(line);
    let mut fields = read.map_err(|e| {
        // Where the line is JSON of another kind, the position says nothing.
        let cause = if e.is_data() { String::new() } else { format!(" ({e})") };
        let text = format!("the line is no JSON object {{..}}{cause}; `palpate help control` has examples");
        (Value::Null, Fault::from(text))
    })?;
    let id = fields.remove("id").unwrap_or_default();
    let message = (|| {
        let token = match fields.remove("token") {
            None | Some(Value::Null) => None,
            Some(Value::String(token)) => Some(token),
            Some(_) => return Err(Fault::of("token", "the token is a text")),
        };
        let Some(Value::String(name)) = fields.remove("request") else {
            return Err(Fault::of("request", "name the request, as in {\"request\": \"vent\"}"));
        };
        let request = serde_path_to_error::deserialize(Value::from(Map::from_iter([(name, Value::from(fields))])))
            .map_err(|error| fault_of(&error))?;
        check(&request)?;
        Ok((token, request))
    })();
    match message {
        Ok((token, request)) => Ok(Message { id, token, request }),
        Err(fault) => Err((id, fault)),
    }
}

/// The fault with the field that it is about.
fn fault_of(error: &serde_path_to_error::Error<serde_json::Error>) -> Fault {
    let text = error.inner().to_string();
    // The path begins with the name of the request.
    let path = error.path().to_string();
    let inner = path.split_once('.').map(|(_, inner)| inner.to_owned());
    let mut inner = inner.filter(|inner| !inner.is_empty() && inner != "?");
    let named = text.split('`').nth(1).unwrap_or_default();
    let missing = text.starts_with("missing field") || text.starts_with("unknown field");
    if text.starts_with("unknown variant") && inner.is_none() {
        inner = Some("request".to_owned());
    } else if missing && inner.as_deref().is_none_or(|inner| !inner.ends_with(named)) {
        inner = Some(inner.map_or_else(|| named.to_owned(), |inner| format!("{inner}.{named}")));
    }
    Fault { field: inner, text: in_plain_words(text) }
}

/// What serde says of a field, in words of JSON: `write a number, not a text` for `invalid type: string "1", expected f64`.
fn in_plain_words(text: String) -> String {
    let quoted = |name: &str| name.replace('`', "\"");
    if let Some((found, wanted)) = text.strip_prefix("invalid type: ").and_then(|rest| rest.rsplit_once(", expected "))
    {
        return format!("write {}, not {}", json_kind(wanted), json_kind(found));
    }
    for (own, plain) in [("unknown variant ", "there is no"), ("unknown field ", "there is no field")] {
        if let Some((name, rest)) = text.strip_prefix(own).and_then(|rest| rest.split_once(", ")) {
            let names =
                rest.strip_prefix("expected ").map(|names| names.trim_start_matches("one of ").replace('`', ""));
            return format!(
                "{plain} {}{}",
                quoted(name),
                names.map_or(String::new(), |names| format!(": choose {names}"))
            );
        }
    }
    match text.strip_prefix("missing field ") {
        Some(name) => format!("the field {} is missing", quoted(name)),
        None => text,
    }
}

/// A type of serde in words of JSON.
fn json_kind(of_serde: &str) -> &str {
    let kind = of_serde.trim_start_matches("a ").trim_start_matches("an ");
    match kind.split(' ').next().unwrap_or_default() {
        "f64" | "floating" => "a number",
        "i64" | "integer" => "a whole number",
        "bool" | "boolean" => "true or false",
        "string" => "a text",
        "struct" | "map" => "an object {..}",
        "array" | "sequence" => "a list [..]",
        "unit" | "null" => "null",
        _ => of_serde,
    }
}

/// Refuses numbers out of range.
fn check(request: &Request) -> Result<(), Fault> {
    let within = |field: &str, value: f64, least: f64, most: f64, unit: &str| match (least..=most).contains(&value) {
        true => Ok(()),
        false => Err(Fault::of(field, format!("{value} is not from {least} to {most} {unit}"))),
    };
    match request {
        Request::Pressure { bar } | Request::Close { bar: Some(bar) } => within("bar", *bar, 0.0, MOST_BAR, "bar"),
        Request::Record { seconds: Some(seconds), .. } => within("seconds", *seconds, 0.1, MOST_S, "s"),
        Request::Place { by: Some(by), .. } => {
            within("move.turn_deg", by.turn_deg, -MOST_TURN_DEG, MOST_TURN_DEG, "degrees")?;
            by.shift_mm.iter().try_for_each(|shift| within("move.shift_mm", *shift, -MOST_MM, MOST_MM, "mm"))?;
            within("move.lift_mm", by.lift_mm, -MOST_MM, MOST_MM, "mm")
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn requests_are_read() {
        let read = |line: &str| parse(line.as_bytes()).map(|message| (message.id, message.token, message.request));
        let cases = [
            (r#"{"request":"vent"}"#, Request::Vent {}),
            (
                r#"{"request":"grasp","object":"lemon"}"#,
                Request::Grasp { object: Some("lemon".to_owned()), again: false },
            ),
            (r#"{"request":"close"}"#, Request::Close { bar: None }),
            (r#"{"request":"subscribe","to":"rows"}"#, Request::Subscribe { to: Subscription::Rows }),
            (
                r#"{"request":"place","move":{"turn_deg":30}}"#,
                Request::Place { object: None, by: Some(GripperPose { turn_deg: 30.0, ..GripperPose::default() }) },
            ),
        ];
        for (line, request) in cases {
            assert_eq!(read(line), Ok((Value::Null, None, request)), "{line}");
        }
        let (id, token, _) = read(r#"{"token":"t","request":"pressure","bar":0.5,"id":[1]}"#).expect("sound");
        assert_eq!((id, token.as_deref()), (serde_json::json!([1]), Some("t")));
    }

    #[test]
    fn faults_name_the_field() {
        for (line, field) in [
            ("", None),
            ("[1]", None),
            ("{\"id\":7", None),
            (r#"{"id":7}"#, Some("request")),
            (r#"{"id":7,"request":3}"#, Some("request")),
            (r#"{"id":7,"request":"wave"}"#, Some("request")),
            (r#"{"id":7,"request":"vent","token":3}"#, Some("token")),
            (r#"{"id":7,"request":"vent","now":true}"#, Some("now")),
            (r#"{"id":7,"request":"pressure"}"#, Some("bar")),
            (r#"{"id":7,"request":"pressure","bar":"1"}"#, Some("bar")),
            (r#"{"id":7,"request":"pressure","bar":1.6}"#, Some("bar")),
            (r#"{"id":7,"request":"close","bar":-0.1}"#, Some("bar")),
            (r#"{"id":7,"request":"label","object":"a","trial":"b"}"#, Some("trial")),
            (r#"{"id":7,"request":"subscribe","to":"all"}"#, Some("to")),
            (r#"{"id":7,"request":"record","seconds":0}"#, Some("seconds")),
            (r#"{"id":7,"request":"place","move":{"turn_deg":"a"}}"#, Some("move.turn_deg")),
            (r#"{"id":7,"request":"place","move":{"turn":1}}"#, Some("move.turn")),
            (r#"{"id":7,"request":"place","move":{"lift_mm":90}}"#, Some("move.lift_mm")),
        ] {
            let (id, fault) = parse(line.as_bytes()).expect_err(line);
            assert_eq!(fault.field.as_deref(), field, "{line}: {fault:?}");
            assert!(field.is_none() || id == 7, "{line}: {id}");
            for jargon in ["variant", "f64", "i64", "map", "expected", "invalid type", "`"] {
                let text = fault.text.replace("`palpate help control`", "");
                assert!(!text.contains(jargon) || field.is_none(), "{line}: {text}");
            }
        }
    }

    #[test]
    fn faults_say_in_words_of_json_what_to_write() {
        for (line, wanted) in [
            ("[1]", "the line is no JSON object {..}; "),
            (r#"{"request":"wave"}"#, r#"there is no "wave": choose grasp, close, vent"#),
            (r#"{"request":"pressure","bar":"1"}"#, "write a number, not a text"),
            (r#"{"request":"pressure"}"#, r#"the field "bar" is missing"#),
            (r#"{"request":"grasp","again":1}"#, "write true or false, not a whole number"),
            (r#"{"request":"place","move":3}"#, "write an object {..}, not a whole number"),
            (r#"{"request":"place","move":{"shift_mm":3}}"#, "write a list [..], not a whole number"),
            (r#"{"request":"place","move":{"turn":1}}"#, r#"there is no field "turn": choose turn_deg"#),
            (r#"{"request":"vent","now":true}"#, r#"there is no field "now""#),
        ] {
            let (_, fault) = parse(line.as_bytes()).expect_err(line);
            assert!(fault.text.starts_with(wanted), "{line}: {}", fault.text);
        }
    }

    #[test]
    fn a_fault_of_a_trial_has_the_name_that_commands_take() {
        let found = FlagRemark { flag: palpate_store::labels::Flag::NoContact, remark: "no pad".to_owned() };
        let answer = Answer { flags: vec![FlagMessage::from(&found)], ..Answer::default() };
        let wanted = r#"{"flags":[{"flag":"no-contact","text":"no pad"}]}"#;
        assert_eq!(serde_json::to_string(&answer).expect("JSON"), wanted);
    }

    #[test]
    fn the_schema_has_every_request_and_event() {
        let schema = schema().to_string();
        for name in ["grasp", "close", "vent", "pressure", "tare", "record", "label", "recognise", "advise", "place"] {
            assert!(schema.contains(&format!("\"const\":\"{name}\"")), "{name}");
        }
        for name in ["subscribe", "rows", "verdict", "trial", "lost", "shift_mm", "field"] {
            assert!(schema.contains(&format!("\"{name}\"")), "{name}");
        }
    }

    proptest! {
        #[test]
        fn no_line_is_a_panic(line in proptest::collection::vec(any::<u8>(), 0..200), text in "\\PC{0,80}") {
            let _read = parse(&line);
            let _read = parse(text.as_bytes());
        }
    }
}
