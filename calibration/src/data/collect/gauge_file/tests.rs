use super::super::gauge::Bad;
use super::*;

/// The readings of a file with one clock, N.
fn forces(text: &str) -> Vec<Option<f64>> {
    let series = parse(text, None).unwrap_or_else(|error| panic!("{text}: {error:#}"));
    assert_eq!(series.len(), 1, "{text}");
    let joined = series[0].joined();
    [0.5, 1.0, 1.5].map(|time_s| joined.at(time_s)).to_vec()
}

const EXPECTED: [f64; 3] = [0.0, 0.1, -0.05];

/// The same three readings in the formats of instruments, programs and spreadsheets.
#[test]
fn files_of_all_kinds_say_the_same() {
    for text in [
        "0.5,0\n1.0,0.1\n1.5,-0.05\n",
        "0.5,0 N\n1.0,+0.100 N\n1.5,\u{2212}0.05 N\n",
        "time,force\r\n0.5,0.0N\r\n1.0,0.1N\r\n1.5,-0.05N\r\n",
        "Time (s),Force (mN)\n0.5,0\n1.0,100\n1.5,-50\n",
        "Time (ms),Force (mN)\n500,0\n1000,100\n1500,-50\n",
        "Zeit [s];Kraft [N]\r\n0,5;0,0000\r\n1,0;0,1000\r\n1,5;-0,0500\r\n",
        "Zeit [s]\tKraft [N]\r\n0,5\t0,0000\r\n1,0\t0,1000\r\n1,5\t-0,0500\r\n",
        "\"0,5\",\"0,0\"\n\"1,0\",\"0,1\"\n\"1,5\",\"-0,05\"\n",
        "t;F/mN\n0.5;0\n1.0;100\n1.5;-50\n",
        "time_s,force_mN\n0.5,0\n1.0,100\n1.5,-50\n",
        "time_s,force\n0.5,0\n1.0,0.1\n1.5,-0.05\n",
        "Time,Load,Unit\n0.5,0,mN\n1.0,100,mN\n1.5,-50,mN\n",
        "0.5,0.0,N\n1.0,0.1,N\n1.5,-0.05,N\n",
        "0.5  0.0 N\n1.0  0.1 N\n1.5  -0.05 N\n",
        "0.5;0.0 N;\n1.0;0.1 N;\n1.5;-0.05 N;\n",
        "Model: M5-012\nSerial: 123\n\nReading,Time\n0.0 N,0.5\n0.1 N,1.0\n-0.05 N,1.5\n",
        "No,Peak force (N),Time (s),Force (N)\n1,0.2,0.5,0\n2,0.2,1.0,0.1\n3,0.2,1.5,-0.05\n",
        "00:00:00.5,0 N\n00:00:01.0,0.1 N\n00:00:01.5,-0.05 N\n",
        "# made by hand\n0.5,+0.000NTO\n\n1.0,+0.100NTO\n1.5,-0.050NTO\n",
    ] {
        let found = forces(text);
        for (found, expected) in found.iter().zip(EXPECTED) {
            let off = found.map_or(f64::INFINITY, |found| (found - expected).abs());
            assert!(off < 1e-12, "{text}: {found:?}");
        }
    }
    // A pound is 4.448 N, a gram 9.807 mN.
    for (text, expected) in [
        ("0.5,0.0 lbF\n1.0,0.01 lbF\n1.5,0.0 lbF\n", 0.044_482_216),
        ("t,F [gf]\n0.5,0\n1.0,10\n1.5,0\n", 0.098_066_5),
        ("t,F (lbf)\n0.5,0\n1.0,0.01\n1.5,0\n", 0.044_482_216),
        (
            "0.5,ST,+00000.00  g\n1.0,US,+00010.00  g\n1.5,ST,+00000.00  g\n",
            0.098_066_5,
        ),
        (
            "0.5;ST,+00000.00  g\n1.0;US,+00010.00  g\n1.5;ST,+00000.00  g\n",
            0.098_066_5,
        ),
        ("0.5,+0.00KTO\n1.0,+0.01KTO\n1.5,+0.00KTO\n", 0.098_066_5),
    ] {
        let found = forces(text)[1].unwrap();
        assert!((found - expected).abs() < 1e-8, "{text}: {found}");
    }
}

/// Ambiguous and meaningless files are refused, with the line and the remedy.
#[test]
fn what_is_not_clear_is_refused_with_what_helps() {
    for (text, unit, words) in [
        ("", None, &["no line is a time and a reading"][..]),
        (
            "time,force\n\u{fffd}\u{fffd},0.1N\n",
            None,
            &["line 1 is `time,force`", "12.34,+0.123N"],
        ),
        (
            "0.5,x\n1.0,y\n",
            None,
            &["0 readings and 2 other lines", "line 1, `x`"],
        ),
        (
            "0.5,1 2 N\n1.0,1 3 N\n",
            None,
            &["0 readings", "(no reading 2)"],
        ),
        (
            "0,5,0,0\n1,0,0,1\n",
            None,
            &["line 1 has commas between columns and in numbers", "`;`"],
        ),
        (
            "0.5;0,1\n1.0;0,2\n",
            None,
            &["a comma at line 1 and a point at line 1"],
        ),
        ("t;F\n0.5;1,234\n", None, &["which is the decimal mark"]),
        (
            "0.5,0.1,3\n1.0,0.2,3\n",
            None,
            &["line 1 has 3 columns", "name them"],
        ),
        (
            "t,Force A,Force B\n0,1,2\n",
            None,
            &["line 1: columns 2 (`Force A`) and 3"],
        ),
        (
            "t,Force (psi)\n0,1\n",
            None,
            &["line 1: `Force (psi)` has an unknown unit of force"],
        ),
        ("t (h),Force (N)\n0,1\n", None, &["unknown unit of time"]),
        (
            "t,F (mN)\n0,1\n1,2\n",
            Some("N"),
            &["line 1 says that readings are in mN"],
        ),
        (
            "0,0\n1,201\n",
            None,
            &["no reading names a unit", "--gauge-unit mN?"],
        ),
        ("0,0.0\n1,20.5\n", None, &["--gauge-unit mN or gf?"]),
        (
            "0,0\n1,201\n",
            Some("N"),
            &["readings span 201.000 N", "is the unit right"],
        ),
        ("0,0 N\n1,6 N\n", None, &["readings span 6.000 N"]),
    ] {
        let unit = unit.map(|unit| unit.parse().unwrap());
        let error = format!("{:#}", parse(text, unit).unwrap_err());
        for words in words {
            assert!(error.contains(words), "{text:?}: no {words}: {error}");
        }
    }
    let said = Some("mN".parse().unwrap());
    assert!(parse("0,0\n1,201\n", said).is_ok());
    assert!(parse("t,F (mN)\n0,1\n1,2\n", said).is_ok());
}

#[test]
fn faults_are_counted_by_cause_and_the_first_is_named() {
    let text = "time;force\n# made by hand\n0.0;+0.100N\n0.1;0.200\n0.2;OL\n\n0.3;+0.4N\n\
                0.25;0.5N\nx;1\n0.5;1..2N\n0.6;0.1\n0.7;0.1\n0.8;0.1\n";
    let series = &parse(text, None).unwrap()[0];
    assert_eq!(series.readings(), 6);
    let counts: Vec<_> = series.bad.iter().map(|(why, n)| (*why, *n)).collect();
    assert_eq!(
        counts,
        [(Bad::NoReading, 1), (Bad::Overload, 1), (Bad::Time, 2)]
    );
    assert_eq!(series.first_bad, Some((5, "OL".into())));
    let complaint = series.complaint().unwrap();
    assert!(
        complaint.contains("4 gauge lines were not used (no reading 1"),
        "{complaint}"
    );
}

#[test]
fn a_clock_that_starts_again_begins_another_series() {
    let rising = |from: f64| {
        let lines = (0..6).map(|i| format!("{:.1},0.1N\n", from + 0.1 * f64::from(i)));
        lines.collect::<String>()
    };
    let series = parse(&format!("t,F\n{}{}", rising(20.0), rising(3.0)), None).unwrap();
    assert_eq!(series.len(), 2);
    assert_eq!(series[0].begins, None);
    assert_eq!(series[1].begins, Some((8, 20.5)));
    assert_eq!(series[1].span(), Some([3.0, 3.5]));
}

#[test]
fn a_file_that_cannot_be_used_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("gauge.csv");
    let error = format!("{:#}", load(&path, None).unwrap_err());
    assert!(
        error.contains("cannot read") && error.contains("gauge.csv"),
        "{error}"
    );
    std::fs::write(&path, b"0,0\n1,201\n").unwrap();
    let error = format!("{:#}", load(&path, None).unwrap_err());
    assert!(error.contains("gauge.csv: no reading names"), "{error}");
}

proptest::proptest! {
    /// Any text is read or refused, and readings that are accepted are in order.
    #[test]
    fn any_text_is_a_series_or_refused(text in "[0-9.,;:\t \nN\"mg#+-]{0,200}") {
        match parse(&text, None) {
            Ok(all) => for series in all {
                let [first, last] = series.span().unwrap();
                proptest::prop_assert!(first <= last);
            },
            Err(error) => proptest::prop_assert!(!error.to_string().is_empty()),
        }
    }

    /// Tables in an unambiguous format are read as they were written.
    #[test]
    fn tables_come_back(
        steps in proptest::collection::vec(-250_i32..=250, 2..40),
        comma in proptest::prelude::any::<bool>(),
        tab in proptest::prelude::any::<bool>(),
        unit in proptest::sample::select(vec!["N", "mN"]),
        in_heading in proptest::prelude::any::<bool>(),
    ) {
        let mark = if tab { '\t' } else { ';' };
        let size = if unit == "mN" { 1e-3 } else { 1.0 };
        let shown = |number: f64| {
            let text = format!("{number:.4}");
            if comma { text.replace('.', ",") } else { text }
        };
        let mut text = match in_heading {
            true => format!("Time (s){mark}Force [{unit}]\n"),
            false => String::new(),
        };
        let own = if in_heading { "" } else { unit };
        for (i, step) in steps.iter().enumerate() {
            let (time, force) = (0.01 * i as f64, 1e-3 * f64::from(*step) / size);
            text += &format!("{}{mark}{}{own}\n", shown(time), shown(force));
        }
        let series = parse(&text, None).unwrap();
        proptest::prop_assert_eq!(series.len(), 1);
        let joined = series[0].joined();
        for (i, step) in steps.iter().enumerate() {
            let shown: f64 = format!("{:.4}", 0.01 * i as f64).parse().unwrap();
            let found = joined.at(shown).unwrap();
            proptest::prop_assert!((found - 1e-3 * f64::from(*step)).abs() < 1e-6);
        }
    }
}
