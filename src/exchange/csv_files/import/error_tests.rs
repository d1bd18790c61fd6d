//! Every fault of a file, with the sentence it earns.

use super::*;

/// The error's text.
fn refusal(text: &[u8]) -> String {
    read_csv(text, "f", &Mapping::default(), "").expect_err("must be refused").to_string()
}

fn refused(text: &str, essence: &[&str]) {
    let said = refusal(text.as_bytes());
    for part in essence {
        assert!(said.contains(part), "no {part} in: {said}");
    }
}

/// Below a usual header, the rows.
fn rows_refused(rows: &str, essence: &[&str]) {
    refused(&format!("trial,label,t_s,size,shape,p\n{rows}"), essence);
}

#[test]
fn files_without_content() {
    refused("", &["cannot import \"f\": the file has no header"]);
    refused("\n , ,\n", &["no header"]);
    refused("trial,label,t_s,p\n\n,,,\n", &["no row below its header"]);
    refused("a,x,0,1\n", &["line 1: there is no column \"label\" and no \"t_s\"", "has a, x, 0, 1"]);
    refused(
        "\n\ntrial;class;time;p\n",
        &["line 3: there is no column \"label\" and no \"t_s\"", "has trial, class, time, p"],
    );
    refused("trial,label,t_s,phase\na,x,0,pre\na,x,1,post\n", &["no column holds numbers"]);
    assert!(refusal(b"\xFF\xFEt\0r\0i\0a\0l\0").contains("save the file as \"CSV UTF-8\""));
    assert!(refusal(b"trial,label,t_s,p\na,K\xE4se,0,1\n").contains("line 2: the column \"label\" holds bytes"));
}

#[test]
fn doubtful_headers() {
    let refused_header = |names: &str, essence: &str| refused(&format!("{names}\n"), &[essence]);
    refused_header("trial,label,t_s,p [Pa],p", "two columns are called \"p\"");
    refused_header("trial,label,t_s,T_s,p", "two columns are called \"t_s\"");
    refused_header("trial,label,t_s [Pa],p", "\"Pa\" is no unit of time");
    refused_header("trial,label,t_s,p [cups]", "\"cups\" is not a unit that is known (s, ms, us, ns; N,");
    refused_header("trial,label,t_s,force_left [kPa]", "\"kPa\" is no unit of force");
    refused_header("trial,label,t_s,size", "one column per sensor channel");
    refused_header(&format!("trial,label,t_s,{}", "x".repeat(201)), "201 characters");
    let many = |count: usize| (0..count).map(|i| format!(",c{i}")).collect::<String>();
    refused_header(&format!("trial,label,t_s{}", many(201)), "more than 200 columns of readings");
    refused_header(&format!("trial,label,t_s{}", many(200)), "no row below its header");
}

#[test]
fn lines_are_counted_through_blanks_and_breaks() {
    for end in ["\n", "\r\n", "\r"] {
        let text = "\ntrial,label,t_s,notes,p\n\na,x,0,\"two\nlines\",1\n,,,,\n\na,x,q,,1".replace('\n', end);
        refused(&text, &["line 8: the time \"q\" is not a number of seconds"]);
    }
}

#[test]
fn rows_that_do_not_fit() {
    rows_refused("a,x,0,,\n", &["line 2: the row has 5 fields but the header has 6"]);
    rows_refused("a,x,0,,,1,2\n", &["has 7 fields"]);
    rows_refused(" ,x,0,,,1\n", &["\"trial\" is empty"]);
    rows_refused("a,,0,,,1\n", &["\"label\" is empty"]);
    rows_refused("a,x,,,,1\n", &["\"t_s\" is empty"]);
    rows_refused(&format!("a,{},0,,,1\n", "x".repeat(201)), &["201 characters, the limit is 200"]);
    rows_refused("a,\"x\ny\",0,,,1\n", &["line 2: the name \"x\\ny\" in \"label\" has a line break"]);
    rows_refused("a\u{7},x,0,,,1\n", &["a\\u{7}", "\"trial\""]);
    rows_refused("a,x,0,Huge,,1\n", &["line 2: \"Huge\" is not a size; allowed are tiny, large"]);
    rows_refused("a,x,0,,flat,1\n", &["\"flat\" is not a shape; allowed are cubic, cylindrical, spherical"]);
    rows_refused(&format!("a,\"x,{}", "y,0\n".repeat(300_000)), &["longer than 1 MiB", "quotation mark"]);
}

#[test]
fn an_endless_row_is_cut() {
    let said = read_csv(std::io::repeat(b'x'), "f", &Mapping::default(), "").expect_err("never ends").to_string();
    assert!(said.contains("longer than 1 MiB"), "{said}");
}

#[test]
fn numbers_that_are_none() {
    rows_refused("a,x,0,,,1\na,x,1,,,oops\n", &["line 3: \"oops\" in the column \"p\" is not a number"]);
    rows_refused("a,x,0,,,oops\na,x,1,,,1\n", &["line 2: \"oops\"", "or remove the column"]);
    rows_refused("a,x,0,,,1\na,x,1,,,\"1,5\"\n", &["decimal commas need a semicolon"]);
    for reading in ["-inf", "1e39", "9.9e37", "-9.91E+37"] {
        rows_refused(
            &format!("a,x,0,,,{reading}\n"),
            &["line 2: ", reading, "in the column \"p\" is no reading", "over range"],
        );
    }
    rows_refused("a,x,nan,,,1\n", &["the time \"nan\" is not a number"]);
    rows_refused("a,x,inf,,,1\n", &["the time \"inf\""]);
    rows_refused("a,x,1700000000000,,,1\n", &["1700000000000 s is beyond", "as in t_s [ms]"]);
}

#[test]
fn trials_that_contradict_themselves() {
    rows_refused("a,x,23:59:59.9,,,1\na,x,0:00:00.1,,,1\n", &["line 3: in trial \"a\" the time falls", "midnight"]);
    rows_refused("a,x,3/4/2026 1:00:00 PM,,,1\n", &["line 2: the time \"3/4/2026", "the year must come first"]);
    rows_refused("a,x,1,,,1\na,x,0.5,,,1\n", &["line 3: in trial \"a\" the time falls from 1 s to 0.5 s"]);
    rows_refused(
        "a,x,0,,,1\nb,y,0,,,1\na,y,1,,,1\n",
        &["line 4: the label of trial \"a\" changes from \"x\" to \"y\""],
    );
    rows_refused(
        "a,x,0,tiny,,1\na,x,1,,,1\nb,x,0,large,,1\n",
        &["line 4: the size of \"x\" is \"tiny\" in earlier rows and \"large\" here"],
    );
    rows_refused("a,x,0,,cubic,1\nb,x,0,,spherical,1\n", &["the shape of \"x\" is \"cubic\""]);
    rows_refused(
        "a,x,0,,,1\na,x,1,,,1\nb,y,0,,,\nb,y,1,,,nan\n",
        &["line 4: trial \"b\" has no reading of the channel \"p\""],
    );
    rows_refused("a,x,0,,,1\na,x,1,,,1\nb,y,0,,,2\n", &["line 4: trial \"b\" has only 1 sample"]);
    rows_refused("a,x,0,,,1\na,x,0,,,2\n", &["trial \"a\" has only 1 sample", "at different times"]);
    rows_refused(
        "a,x,0,,,1\na,x,1,,,1\nb,y,0,,,1\nb,y,1,,,1\nc,y,0,,,1\nc,y,0.5,,,1\n",
        &["line 6: trial \"c\" lasts 0.5 s, less than one step at the common rate of 1 Hz"],
    );
}

#[test]
fn wild_times_ask_for_no_memory() {
    rows_refused("a,x,0,,,1\na,x,0.01,,,1\na,x,1e12,,,1\n", &["line 4: the time 1000000000000 s is beyond"]);
    rows_refused(
        "a,x,0,,,1\na,x,0.01,,,1\na,x,0.02,,,1\na,x,1e10,,,1\n",
        &["line 2: trial \"a\" runs from 0 s to 10000000000 s", "100 Hz", "wrong time"],
    );
    // Each trial within its bounds, but not all of them together.
    let mut many = "trial,label,t_s,p,q\n".to_owned();
    for trial in 0..150 {
        many.push_str(&format!("{trial},x,0,1,1\n{trial},x,0.001,1,1\n{trial},x,0.002,1,1\n{trial},x,999,1,1\n"));
    }
    refused(&many, &["more than 200000000 readings"]);
}

#[test]
fn more_than_is_meant() {
    let mut long = "trial,label,t_s,p\n".to_owned();
    (0..=MOST_SAMPLES).for_each(|k| long.push_str(&format!("a,x,{k},1\n")));
    refused(&long, &["line 1000002: trial \"a\" has more than 1000000 samples"]);
    let mut many = "trial,label,t_s,p\n".to_owned();
    (0..=MOST_TRIALS).for_each(|k| many.push_str(&format!("{k},x,0,1\n")));
    refused(&many, &["more than 1000000 trials"]);
    // Long names of many channels, once for each of many trials.
    let names: Vec<String> = (0..200).map(|i| format!("{i}{}", "n".repeat(197))).collect();
    let mut heavy = format!("trial,label,t_s,{}\n", names.join(","));
    let readings = ",1".repeat(200);
    (0..50_000).for_each(|k| heavy.push_str(&format!("{},x,{}{readings}\n", k / 2, k % 2)));
    refused(&heavy, &["25000 trials with 200 channels each are too many"]);
}

#[test]
fn two_decimal_signs_are_one_too_many() {
    let of = |rows: &str| refused(&format!("trial;label;t_s;p\n{rows}"), &["separate thousands", "line 2"]);
    of("a;x;0.000;2,000\n");
    of("a;x;0,000;2.000\n");
    refused("trial;label;t_s;p\na;x;0;1,5\na;x;1;2.5\n", &["line 3", "\"2.5\" with a point and \"1,5\" with a comma"]);
}

#[test]
fn times_that_may_be_numbers_of_samples() {
    let rows: String = (0..9).map(|k| format!("a,x,{k},{k}\n")).collect();
    refused(&format!("trial,label,t_s,p\n{rows}"), &["line 2: the times rise by 1", "t_s [ms]"]);
    for (unit, step_s) in [("s", 1.0), ("ms", 1e-3)] {
        let import = read_csv(format!("trial,label,t_s [{unit}],p\n{rows}").as_bytes(), "f", &Mapping::default(), "")
            .expect("a unit is enough");
        let t_s = &import.trials[0].signals.t_s;
        assert!((t_s[8] - 8.0 * step_s).abs() < 1e-12, "{t_s:?}");
    }
}
