//! Small files and what they must be read as.

use super::*;
use crate::mapping::Mapping;

fn read(text: &str) -> Import {
    read_csv(text.as_bytes(), "grasps.csv", &Mapping::default(), "").expect("a good file")
}

/// The only trial's readings of its only channel.
fn values(import: &Import) -> &[f32] {
    &import.trials[0].signals.values
}

const GOLDEN: &str = "\
trial,label,t_s,size,shape,left [Pa],right (Pa)
a 1,Apple,0,tiny,Spherical,1,10
a 1,Apple,0.01,,,2,20
b,Tin can,5,LARGE,cylindrical,3,30
b,Tin can,5.01,,,4,40
c,Apple,0,,,5,50
c,Apple,0.01,,,6,60
";

#[test]
fn a_regular_file_is_read_as_it_stands() {
    let import = read(GOLDEN);
    assert_eq!(import.warnings, Vec::<String>::new());
    let said: Vec<_> = import
        .trials
        .iter()
        .map(|t| (t.name.as_str(), t.label.as_str(), t.size.as_deref(), t.shape.as_deref()))
        .collect();
    let apple = (Some("tiny"), Some("spherical"));
    assert_eq!(
        said,
        [
            ("a 1", "Apple", apple.0, apple.1),
            ("b", "Tin can", Some("large"), Some("cylindrical")),
            ("c", "Apple", apple.0, apple.1)
        ]
    );
    let second = &import.trials[1].signals;
    assert_eq!(second.channels, ["left [Pa]", "right [Pa]"]);
    assert_eq!(
        (second.t_s.as_slice(), second.values.as_slice()),
        ([5.0, 5.01].as_slice(), [3.0, 30.0, 4.0, 40.0].as_slice())
    );
}

#[test]
fn dialects_say_the_same() {
    let plain = read(GOLDEN);
    let quoted = GOLDEN.replace("Tin can", "\"Tin can\"").replace("0.01", "\" 0.01 \"");
    let spreadsheet = GOLDEN.replace(',', ";").replace('.', ",").replace('\n', "\r\n");
    let filled_up = GOLDEN.replace('\n', ",,\n").replacen("(Pa),,", "(Pa)", 1).replace("\nb", "\n,,,,,,\n\n  \nb");
    let shouting = GOLDEN.replacen("trial,label,t_s", " TRIAL , Label,T_S [s]", 1);
    for text in [
        format!("\u{feff}{GOLDEN}"),
        format!("\n\r\n{}", GOLDEN.trim_end()),
        GOLDEN.replace('\n', "\r"),
        GOLDEN.replace(',', "\t"),
        quoted,
        spreadsheet,
        filled_up,
        shouting,
    ] {
        assert_eq!(read(&text), plain, "{text}");
    }
}

#[test]
fn rows_of_different_trials_may_alternate() {
    let import = read("p,t_s,label,trial\n1,0,x,a\n5,0,y,b\n2,1,x,a\n6,1,y,b\n3,2,x,a\n7,2,y,b\n");
    assert_eq!(values(&import), [1.0, 2.0, 3.0]);
    assert_eq!(import.trials[1].signals.values, [5.0, 6.0, 7.0]);
}

#[test]
fn a_regular_file_comes_through_exactly() {
    let mut text = "trial,label,t_s,a,b\n".to_owned();
    let mut written = Vec::new();
    for trial in 0..6_u32 {
        for k in 0..80_u32 {
            let t = f64::from(k) / 75.0;
            let row = [(t * 7.3).sin() as f32 * 1e-5, 101_325.0 + t.cos() as f32 * (1 + trial) as f32];
            text.push_str(&format!("{trial},{},{t},{},{}\n", trial % 2, row[0], row[1]));
            written.push((t, row));
        }
    }
    let import = read(&text);
    assert_eq!(import.warnings, Vec::<String>::new());
    let samples = import.trials.iter().flat_map(|t| (0..t.signals.len()).map(|k| (t.signals.t_s[k], t.signals.row(k))));
    assert!(samples.zip(&written).all(|((t, row), (wt, wrow))| t.to_bits() == wt.to_bits() && row == wrow));
    assert_eq!(import.trials.iter().map(|t| t.signals.len()).sum::<usize>(), written.len());
}

#[test]
fn columns_without_numbers_are_left_out() {
    let import =
        read(",trial,label,t_s,phase,p,notes\n0,a,x,0,pre,1,\n1,a,x,1,\"con\ntact\",2,\n2,b,y,0,,3,\n3,b,y,1,,4,nan\n");
    assert_eq!(import.trials[0].signals.channels, ["p"]);
    assert_eq!(values(&import), [1.0, 2.0]);
    for what in ["column 1 has no name", "\"phase\" holds no number", "\"notes\" holds no number", "only 2 trials"] {
        assert!(import.warnings.iter().any(|w| w.contains(what)), "{what}: {:?}", import.warnings);
    }
    assert_eq!(import.warnings.len(), 4);
}

#[test]
fn gaps_and_repeated_times_are_mended_and_told() {
    let import = read("trial,label,t_s,p\na,x,0,\na,x,1,10\na,x,2,nan\na,x,3,30\na,x,3,40\n");
    assert_eq!(values(&import), [10.0, 10.0, 25.0, 40.0]);
    assert_eq!(
        import.warnings,
        [
            "trial \"a\": at 1 repeated time the last row was kept",
            "trial \"a\": 2 missing readings were interpolated in \"p\"",
            "only one label: a recogniser needs at least two",
            "only 1 trial: too few to train and to test"
        ]
    );
}

#[test]
fn other_rates_come_to_the_common_one() {
    let mut text = "trial,label,t_s,p\n".to_owned();
    for (trial, hz, count) in [("a", 100, 11), ("b", 100, 21), ("c", 50, 6), ("d", 200, 21)] {
        for k in 0..count {
            let t = f64::from(k) / f64::from(hz);
            text.push_str(&format!("{trial},{},{t},{}\n", trial == "a", 3.0 * t));
        }
    }
    let import = read(&text);
    assert_eq!(
        import.warnings,
        [
            "2 of 4 trials were resampled to 100 Hz: the times are uneven or at another rate (50 to 200 Hz)",
            "the trials differ in length: 11 to 21 samples (0.1 to 0.2 s)"
        ]
    );
    for trial in &import.trials {
        assert_eq!(trial.signals.len(), if trial.name == "b" { 21 } else { 11 });
        for (k, t) in trial.signals.t_s.iter().enumerate() {
            assert!((t - 0.01 * k as f64).abs() < 1e-12);
            assert!((f64::from(trial.signals.values[k]) - 3.0 * t).abs() < 1e-6);
        }
    }
}

#[test]
fn the_name_of_a_column_of_times_tells_its_unit() {
    let mapping = Mapping { time: Some("stamp_ms".to_owned()), ..Mapping::default() };
    let import = mapped("stamp_ms,label,p\n0,x,1\n20,x,2\n40,x,3\n", &mapping);
    assert_eq!(import.trials[0].signals.t_s, [0.0, 0.02, 0.04]);
}

#[test]
fn doubtful_rates_are_told() {
    let fast = read("trial,label,t_s,p\na,x,0,1\na,x,0.0005,2\na,x,0.001,3\nb,y,0,1\nb,y,0.0002,2\nb,y,0.0011,3\n");
    assert!(fast.warnings[0].contains("2 of 2 trials were resampled to 1000 Hz"), "{:?}", fast.warnings);
    assert_eq!(
        (fast.trials[0].signals.t_s.as_slice(), values(&fast)),
        ([0.0, 0.001].as_slice(), [1.0, 3.0].as_slice())
    );
    let slow = read("trial,label,t_s,p\na,x,0,1\na,x,13.3,2\nb,y,0,1\nb,y,13.3,2\n");
    assert_eq!(slow.warnings[0], "the trials have only 0.0752 samples per second; check that t_s is in seconds");
}

#[test]
fn many_warnings_of_one_kind_are_counted() {
    let mut text = "trial,label,t_s,p\n".to_owned();
    for trial in 0..150 {
        text.push_str(&format!("{trial},{},0,1\n{trial},{0},1,\n", trial % 2));
    }
    let import =
        read_csv(text.replace("149,0", "149,1").as_bytes(), "many", &Mapping::default(), "").expect("a good file");
    assert_eq!(import.warnings.len(), 101);
    assert_eq!(import.warnings[100], "and 50 more channels of trials with missing readings");
}

#[test]
fn a_file_is_named_in_its_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("grasps.csv");
    let missing = read_file(&path, &Mapping::default()).expect_err("not there").to_string();
    assert!(missing.starts_with("cannot import \"grasps.csv\": No such file"), "{missing}");
    std::fs::write(&path, GOLDEN).expect("writes");
    assert_eq!(read_file(&path, &Mapping::default()).expect("a good file"), read(GOLDEN));
    let is_folder = read_file(folder.path(), &Mapping::default()).expect_err("a folder").to_string();
    assert!(is_folder.contains("directory"), "{is_folder}");
    std::fs::File::create(&path).and_then(|file| file.set_len(LARGEST_FILE + 1)).expect("a hollow file");
    let large = read_file(&path, &Mapping::default()).expect_err("too large").to_string();
    assert!(large.contains("larger than 2 GiB"), "{large}");
}

#[test]
fn readings_in_any_unit_become_the_same() {
    let plain = read(
        "trial,label,t_s,pressure_left [Pa],curvature_right [1/m],force_left [N],grip [V]\na,x,0,1200,7.5,0.6,2\na,x,0.02,1300,7.75,0.65,2.5\n",
    );
    let other = "trial,label,t_s (ms),pressure_left [psi],curvature_right [1/mm],force_left [gf],grip [mV]\n";
    let row = |t: f64, p: f64, k: f64, f: f64, g: f64| {
        format!("a,x,{},{},{},{},{}\n", t * 1e3, p / 6_894.757_293_168_361, k * 1e-3, f / 9.806_65e-3, g * 1e3)
    };
    let import = read(&(other.to_owned() + &row(0.0, 1200.0, 7.5, 0.6, 2.0) + &row(0.02, 1300.0, 7.75, 0.65, 2.5)));
    let [plain, other] = [&plain, &import].map(|import| &import.trials[0].signals);
    assert_eq!(plain.channels, ["pressure_left", "curvature_right", "force_left", "grip [V]"]);
    assert_eq!(other.channels, plain.channels);
    let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 2.0 * f32::EPSILON * a.abs();
    assert!(plain.values.iter().zip(&other.values).all(near), "{:?} {:?}", plain.values, other.values);
    assert_eq!(plain.t_s, other.t_s);
}

#[test]
fn what_stands_above_the_header_is_skipped() {
    let plain = read(GOLDEN);
    for above in ["sep=,\n", "\u{feff}sep=,\r\n", "# logger v3\n# rig: bench, \"left\"\n", "# "] {
        assert_eq!(read(&format!("{above}{GOLDEN}")), plain, "{above}");
    }
    assert_eq!(read(&GOLDEN.replace("\nb,", "\n# a remark, and another\nb,")), plain);
    assert_eq!(read(&GOLDEN.replacen("trial,label,t_s", "'trial','label','t_s'", 1)), plain);
}

/// A table of another program, read by a profile or by a mapping.
fn mapped(text: &str, mapping: &Mapping) -> Import {
    read_csv(text.as_bytes(), "log.csv", mapping, &mapping.label_of(Path::new("mug.7.csv"))).expect("a good file")
}

#[test]
fn tables_of_other_programs_are_read_by_their_profiles() {
    let profile = |name: &str| Mapping::profile(name).expect("there is one");
    let cases = [
        (
            "plotjuggler",
            "__time,/left/force\n1760000000.0,1\n1760000000.02,2\n1760000000.04,3\n",
            "mug.7",
            "/left/force",
        ),
        (
            "serial-studio",
            "RX Date/Time,Flex\n2026/03/01 12:00:00.00,1\n2026/03/01 12:00:00.02,2\n2026/03/01 12:00:00.04,3\n",
            "mug.7",
            "Flex",
        ),
        ("edge-impulse", "timestamp,accX\n0,1\n20,2\n40,3\n", "mug", "accX"),
        ("teleplot", "timestamp(ms);name;value\n1000;flexL;1\n1020;flexL;2\n1040;flexL;3\n", "mug.7", "flexL"),
        (
            "lerobot",
            "episode_index,frame_index,timestamp,task,state\n0,0,0,pick,1\n0,1,0.02,pick,2\n0,2,0.04,pick,3\n",
            "pick",
            "state",
        ),
    ];
    for (name, text, label, channel) in cases {
        let import = mapped(text, &profile(name));
        let trial = &import.trials[0];
        assert_eq!(
            (import.trials.len(), trial.label.as_str(), &trial.signals.channels[..]),
            (1, label, &[channel.to_owned()][..]),
            "{name}"
        );
        assert_eq!(trial.signals.values, [1.0, 2.0, 3.0], "{name}");
        let span = trial.signals.t_s[2] - trial.signals.t_s[0];
        assert!((span - 0.04).abs() < 1e-6, "{name}: {span}");
        let unmapped =
            read_csv(text.as_bytes(), "f", &Mapping::default(), "f").expect_err("needs a profile").to_string();
        let wanted = if profile(name).known_by.is_empty() {
            "--time \"timestamp\"".to_owned()
        } else {
            format!("add --profile {name}")
        };
        assert!(unmapped.contains(&wanted), "{name}: {unmapped}");
    }
}

#[test]
fn columns_get_roles_names_and_units() {
    let text = "# by hand\nnot a header\nclock,what,grip,bend,note\n0,mug,1,10,x\n20,mug,2,11,x\n40,mug,3,12,x\n60,key,4,13,x\n80,key,5,14,x\n";
    let mapping = Mapping {
        skip: 2,
        time: Some("clock [ms]".to_owned()),
        label: Some("what".to_owned()),
        channels: vec!["force_left = grip [kgf]".to_owned(), "bend".to_owned()],
        ..Mapping::default()
    };
    let import = mapped(text, &mapping);
    let labels: Vec<&str> = import.trials.iter().map(|trial| trial.label.as_str()).collect();
    assert_eq!(labels, ["mug", "key"], "without a column of trials, each label begins one");
    assert_eq!(import.trials[0].signals.channels, ["force_left", "bend"]);
    assert_eq!(import.trials[0].signals.row(1), [2.0 * 9.80665, 11.0]);
    assert!((import.trials[1].signals.t_s[1] - import.trials[1].signals.t_s[0] - 0.02).abs() < 1e-12);
    // A line of an error counts the skipped ones.
    let wrong = read_csv(text.replace("4,13", "4,x13").as_bytes(), "f", &mapping, "f").expect_err("no number");
    assert!(wrong.to_string().contains("line 7") && wrong.to_string().contains("x13"), "{wrong}");
    let lacking = Mapping { time: Some("t".to_owned()), ..mapping };
    let error = read_csv(text.as_bytes(), "f", &lacking, "f").expect_err("no such column").to_string();
    assert!(error.contains("no column \"t\"; the file has clock, what, grip"), "{error}");
}

#[test]
fn tables_without_a_header_are_read_by_number() {
    let text = "100.0,1.1\n100.1,1.2\n100.2,1.3\n";
    let error = read_csv(text.as_bytes(), "f", &Mapping::default(), "f").expect_err("no header").to_string();
    assert!(error.contains("first row holds numbers") && error.contains("--channel"), "{error}");
    let mapping =
        Mapping { time: Some("1 [s]".to_owned()), channels: vec!["grip=2 [N]".to_owned()], ..Mapping::default() };
    let import = mapped(text, &mapping);
    assert_eq!(import.trials[0].signals.channels, ["grip [N]"]);
    assert_eq!(import.trials[0].signals.values, [1.1, 1.2, 1.3]);
}

#[test]
fn a_recording_is_split_at_pauses_and_where_its_clock_starts_again() {
    let rows = |from: f64| (0..20).map(move |k| format!("{},{k}\n", from + 0.02 * f64::from(k)));
    let text: String =
        std::iter::once("t_s,p\n".to_owned()).chain(rows(0.0)).chain(rows(3.0)).chain(rows(0.5)).collect();
    let mapping = Mapping { label: Some("mug".to_owned()), split_gap_s: Some(1.0), ..Mapping::default() };
    let import = mapped(&text, &mapping);
    assert_eq!(import.trials.iter().map(|trial| trial.signals.len()).collect::<Vec<_>>(), [20; 3]);
    assert!(import.trials.iter().all(|trial| trial.label == "mug"));
    let whole = Mapping { split_gap_s: None, ..mapping };
    let error = read_csv(text.as_bytes(), "f", &whole, "f").expect_err("falls").to_string();
    assert!(error.contains("--split-by gap"), "{error}");
}

#[test]
fn a_pause_is_a_gap() {
    let rows = |from: f64| (0..20).map(move |k| format!("1,mug,{},{k}\n", from + 0.02 * f64::from(k)));
    let text: String = std::iter::once("trial,label,t_s,p\n".to_owned()).chain(rows(0.0)).chain(rows(1.0)).collect();
    let import = read(&text);
    let signals = &import.trials[0].signals;
    let gaps = signals.gaps();
    assert_eq!((gaps.len(), gaps[0].samples.len(), signals.len()), (1, 30, 70));
    assert!((gaps[0].from_s - 0.38).abs() < 1e-9 && (gaps[0].to_s - 1.0).abs() < 1e-9);
    assert!(
        import.warnings.iter().any(|text| text.contains("flagged: no readings from 0.38 s to 1.00 s (30 missing)"))
    );
}

#[test]
fn sessions_are_told_apart() {
    let rows =
        |session: &str| (0..3).map(|k| format!("{session},1,mug,{},{k}\n", 0.1 * f64::from(k))).collect::<String>();
    let text = format!("session,trial,label,t_s,p\n{}{}{}", rows("monday"), rows("tuesday"), rows(""));
    let import = read(&text);
    let sessions: Vec<Option<&str>> = import.trials.iter().map(|trial| trial.session.as_deref()).collect();
    assert_eq!(sessions, [Some("monday"), Some("tuesday"), None]);
    assert!(import.trials.iter().all(|trial| trial.signals.channels == ["p"] && trial.signals.len() == 3));
    // A blank may stand in either name.
    let text = "session,trial,label,t_s,p\na b,c,mug,0,1\na b,c,mug,0.1,1\na,b c,mug,0,1\na,b c,mug,0.1,2\n";
    assert_eq!(read(text).trials.len(), 2);
}
