//! How long a study still takes, by the runs that it has made.

use std::fmt;

/// Seconds that the settings of a study take.
#[derive(Debug)]
pub(super) struct Pace {
    seconds: Vec<Took>,
}

#[derive(Clone, Copy, Debug)]
enum Took {
    Unknown,
    Seconds(f64),
    /// It is not run again.
    Failed,
}

/// What is left of a study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Left {
    /// Nothing was measured so far.
    Unknown,
    /// Seconds, where settings that were not run so far count as the mean of the others.
    Roughly(f64),
    /// Seconds, every setting as it took before.
    About(f64),
}

impl Pace {
    pub(super) fn new(settings: usize) -> Self {
        let seconds = vec![Took::Unknown; settings];
        Self { seconds }
    }

    pub(super) fn took(&mut self, setting: usize, wall_s: f64) {
        self.seconds[setting] = Took::Seconds(wall_s);
    }

    pub(super) fn failed(&mut self, setting: usize) {
        self.seconds[setting] = Took::Failed;
    }

    /// What is left before the run of a setting, after which every setting has `later` more.
    pub(super) fn left(&self, setting: usize, later: u64) -> Left {
        let (mut known, mut sum_s, mut left_s, mut unknown) = (0.0, 0.0, 0.0, 0.0);
        for (place, took) in self.seconds.iter().enumerate() {
            let runs = later as f64 + f64::from(u8::from(place >= setting));
            match *took {
                Took::Failed => {}
                Took::Unknown => unknown += runs,
                Took::Seconds(s) => {
                    known += 1.0;
                    sum_s += s;
                    left_s += runs * s;
                }
            }
        }
        match (known > 0.0, unknown > 0.0) {
            (false, _) => Left::Unknown,
            (true, true) => Left::Roughly(left_s + unknown * sum_s / known),
            (true, false) => Left::About(left_s),
        }
    }
}

impl fmt::Display for Left {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (how, seconds) = match *self {
            Self::Unknown => return f.write_str("time left is not known yet"),
            Self::Roughly(s) => ("roughly", s),
            Self::About(s) => ("about", s),
        };
        match seconds {
            s if s < 120.0 => write!(f, "{how} {s:.0} s left"),
            s if s < 7200.0 => write!(f, "{how} {:.0} min left", s / 60.0),
            s => write!(f, "{how} {:.1} h left", s / 3600.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_counts_as_it_was_and_the_rest_as_the_mean() {
        let mut pace = Pace::new(3);
        assert_eq!(pace.left(0, 1), Left::Unknown);
        pace.took(0, 2.0);
        // one more run of the first, two of each of the others
        assert_eq!(pace.left(1, 1), Left::Roughly(2.0 + 4.0 * 2.0));
        pace.took(1, 4.0);
        pace.failed(2);
        assert_eq!(pace.left(0, 0), Left::About(6.0));
        assert_eq!(pace.left(1, 0).to_string(), "about 4 s left");
        assert_eq!(Left::Roughly(600.0).to_string(), "roughly 10 min left");
    }
}
