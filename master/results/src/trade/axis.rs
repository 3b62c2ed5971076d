//! A logarithmic axis: its ends, its ticks, and where values lie on it.

/// From one round number to another, along pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogAxis {
    from: i32,
    to: i32,
    pixels: [f64; 2],
}

/// No more ticks than this have a label.
const MOST_TICKS: usize = 8;
/// What is so much smaller than the largest value has no place of its own.
const DECADES: i32 = 4;

impl LogAxis {
    /// Around values, of which those count that are above 0.
    pub(super) fn around(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let positive = values.filter(|&v| v > 0.0 && v.is_finite());
        let (lo, hi) = positive.fold((f64::INFINITY, 0.0_f64), |(lo, hi), v| {
            (lo.min(v), hi.max(v))
        });
        if hi == 0.0 {
            let (from, to) = (0, 1);
            return Self { from, to, pixels };
        }
        let (mut from, mut to) = (at_most(lo), at_most(hi));
        if round(to) < hi {
            to += 1;
        }
        from = from.max(to - 3 * DECADES);
        if from == to {
            from -= 1;
        }
        Self { from, to, pixels }
    }

    /// The pixel of a value; the end of the axis where the value is beyond it.
    pub(super) fn place(&self, value: f64) -> f64 {
        let [lo, hi] = [round(self.from), round(self.to)];
        let part = (value.clamp(lo, hi) / lo).ln() / (hi / lo).ln();
        self.pixels[0] + part * (self.pixels[1] - self.pixels[0])
    }

    /// Round numbers with their labels: 1, 2, 5 of every decade, or powers of ten where those are many.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        let every = |step: i32| {
            let numbers = (self.from..=self.to).filter(move |n| n.rem_euclid(step) == 0);
            numbers.map(round).collect::<Vec<f64>>()
        };
        let mut ticks = every(1);
        if ticks.len() > MOST_TICKS {
            ticks = every(3);
        }
        let label = |v: f64| {
            let plain = (1e-4..1e5).contains(&v);
            if plain {
                v.to_string()
            } else {
                format!("{v:e}")
            }
        };
        ticks.into_iter().map(|v| (v, label(v))).collect()
    }
}

/// 1, 2, 5, 10 ... for 0, 1, 2, 3 ...
fn round(number: i32) -> f64 {
    let digit = [1.0, 2.0, 5.0][number.rem_euclid(3) as usize];
    let decade = number.div_euclid(3);
    let power = 10f64.powi(decade.abs());
    if decade < 0 {
        digit / power
    } else {
        digit * power
    }
}

/// The number of the largest round number that is not above a value.
fn at_most(value: f64) -> i32 {
    let mut number = (3.0 * value.log10()).floor() as i32 + 2;
    while round(number) > value {
        number -= 1;
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: &[f64]) -> Vec<String> {
        let axis = LogAxis::around(values.iter().copied(), [0.0, 100.0]);
        axis.ticks().into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ends_are_round_and_around_all_values() {
        assert_eq!(labels(&[0.3, 0.0, 4.0]), ["0.2", "0.5", "1", "2", "5"]);
        assert_eq!(labels(&[2.0]), ["1", "2"]);
        assert_eq!(labels(&[]), ["1", "2"]);
        assert_eq!(labels(&[0.01, 30.0]), ["0.01", "0.1", "1", "10"]);
    }

    #[test]
    fn places_are_within_the_ends() {
        let axis = LogAxis::around([1.0, 100.0].into_iter(), [10.0, 210.0]);
        assert!((axis.place(10.0) - 110.0).abs() < 1e-9);
        assert_eq!(axis.place(0.0), 10.0);
        assert_eq!(axis.place(1e9), 210.0);
    }
}
