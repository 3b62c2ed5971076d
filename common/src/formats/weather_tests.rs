use proptest::prelude::*;

use super::*;

fn refusal(text: &str) -> String {
    parse("w.csv", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn columns_are_known_by_name_in_any_order_and_case() {
    let text = "\u{feff}Temp,DHI,Time,ghi_W_m2,direct_PAR_W_m2,Diffuse_PAR_w_m2\r\n\
                # a station in the south\n\
                20.5,100,2026-06-21T12:00+02:00,600,200,50\r\n\
                , 0 ,2026-06-21T13:00:00+02:00,0,0,-0\n";
    let weather = parse("w.csv", text.as_bytes()).unwrap();
    assert_eq!(weather.unused, ["Temp"]);
    let [first, second] = &weather.rows[..] else {
        panic!("{weather:?}")
    };
    assert_eq!((first.line, second.line), (3, 4));
    assert_eq!(first.moment.as_second() + 3600, second.moment.as_second());
    assert_eq!(
        (first.ghi_W_m2, first.dhi_W_m2, first.dni_W_m2),
        (Some(600.0), Some(100.0), None)
    );
    let par = BandIrradiance {
        direct_W_m2: 200.0,
        diffuse_W_m2: 50.0,
    };
    assert_eq!(first.bands["PAR"], par);
    assert_eq!(second.bands["PAR"].diffuse_W_m2.to_bits(), 0);
}

#[test]
fn what_cannot_be_is_named_by_its_line() {
    let rows = |rows: &str| refusal(&format!("time,ghi,dhi\n2026-06-21T12:00Z,1,1\n{rows}"));
    for (found, expected) in [
        (
            refusal(""),
            "w.csv: expected a header and at least two rows, found nothing",
        ),
        (
            refusal("time,ghi,dhi\n"),
            "w.csv: expected a header and at least two rows, found 0 rows",
        ),
        (
            refusal("a,ghi,dhi\n"),
            "w.csv, line 1: expected a header with a column time, found 'a,ghi,dhi'",
        ),
        (
            refusal("time,ghi\n"),
            "w.csv, line 1: expected two of ghi_W_m2, dhi_W_m2 and dni_W_m2, or",
        ),
        (
            refusal("time,ghi,GHI_W_m2\n"),
            "w.csv, line 1: expected one column GHI_W_m2, found two",
        ),
        (
            refusal("time,direct_PAR_W_m2\n"),
            "w.csv, line 1: expected columns direct_PAR_W_m2 and diffuse_PAR_W_m2",
        ),
        (
            rows("2026-06-21T13:00Z,1\n"),
            "w.csv, line 3: expected 3 values, as the header has, found 2",
        ),
        (
            rows("2026-06-21T13:00,1,1\n"),
            "w.csv, line 3: expected a time with its offset from UTC",
        ),
        (
            rows("2026-06-31T13:00Z,1,1\n"),
            "w.csv, line 3: expected a time with its offset from UTC",
        ),
        (
            rows("2026-06-21T12:00Z,1,1\n"),
            "w.csv, line 3: expected a time after that of line 2 (2026-06-21T12:00Z), found the same",
        ),
        (
            rows("2026-06-21T13:00+02:00,1,1\n"),
            "w.csv, line 3: expected a time after that of line 2",
        ),
        (
            rows("2026-06-21T13:00Z,,1\n"),
            "w.csv, line 3: expected an irradiance of 0 or 1e-100 to 1e100 in ghi, found nothing",
        ),
        (
            rows("2026-06-21T13:00Z,-1,1\n"),
            "w.csv, line 3: expected an irradiance of 0 or 1e-100 to 1e100 in ghi, found '-1'",
        ),
        (
            rows("2026-06-21T13:00Z,1,NaN\n"),
            "w.csv, line 3: expected an irradiance of 0 or 1e-100 to 1e100 in dhi, found 'NaN'",
        ),
    ] {
        assert!(found.starts_with(expected), "{found}");
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = parse("w.csv", &bytes);
    }

    #[test]
    fn nothing_that_looks_like_weather_makes_it_panic(
        text in "time,(ghi|dhi|dni|direct_P_W_m2|diffuse_P_W_m2|é|_W_m2|direct__W_m2),(dni|ghi)\n((2026-0[0-9]-[0-9][0-9]T[0-9][0-9]:00(Z|\\+[0-9]{2}:00)?|\")?,[-0-9.eNa]{0,4},[0-9]{0,3}(\r|\n|\r\n)){0,6}"
    ) {
        if let Ok(weather) = parse("w.csv", text.as_bytes()) {
            prop_assert!(weather.rows.len() >= 2);
            prop_assert!(weather.rows.windows(2).all(|pair| pair[0].moment < pair[1].moment));
        }
    }
}
