//! Which settings are worth having: those that no other beats, and the cheapest one for a target.

use super::measure::ErrorRange;

/// What counts of a setting: what it costs, and the error of its worst band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Median processor time, seconds.
    pub cpu_s: f64,
    /// Of the band whose error may be largest.
    pub worst: ErrorRange,
}

/// Which points are on the Pareto front: no other is as cheap and as good, and better in one of the two.
pub fn pareto(points: &[Point]) -> Vec<bool> {
    let beats = |a: &Point, b: &Point| {
        let (ea, eb) = (a.worst.percent, b.worst.percent);
        a.cpu_s <= b.cpu_s && ea <= eb && (a.cpu_s < b.cpu_s || ea < eb)
    };
    let free = |p: &Point| !points.iter().any(|other| beats(other, p));
    points.iter().map(free).collect()
}

/// The number of the cheapest point whose error is surely within the target, or why there is none.
pub fn choose(points: &[Point], target_percent: f64) -> Result<usize, Missed> {
    let good = points
        .iter()
        .enumerate()
        .filter(|(_, p)| p.worst.high_percent <= target_percent);
    let cheapest = good.min_by(|a, b| a.1.cpu_s.total_cmp(&b.1.cpu_s));
    if let Some((place, _)) = cheapest {
        return Ok(place);
    }
    let by_high = |a: &&Point, b: &&Point| a.worst.high_percent.total_cmp(&b.worst.high_percent);
    let Some(best) = points.iter().min_by(by_high) else {
        return Err(Missed::NothingMeasured);
    };
    if best.worst.percent <= target_percent {
        Err(Missed::NotSure(best.worst))
    } else {
        Err(Missed::NotReached(best.worst))
    }
}

/// Why no setting is chosen.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Missed {
    /// All settings failed.
    #[error("no setting could be measured")]
    NothingMeasured,
    /// The best one is within the target, its error bar is not.
    #[error(
        "the best setting has an error of {:.3} %, but it may be up to {:.3} %: more --seeds make this range smaller",
        .0.percent, .0.high_percent
    )]
    NotSure(ErrorRange),
    /// The best one is not within the target.
    #[error(
        "the best setting has an error of {:.3} % ({:.3} to {:.3} %)",
        .0.percent, .0.low_percent, .0.high_percent
    )]
    NotReached(ErrorRange),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(cpu_s: f64, percent: f64) -> Point {
        let worst = ErrorRange {
            percent,
            low_percent: 0.9 * percent,
            high_percent: 1.1 * percent,
        };
        Point { cpu_s, worst }
    }

    #[test]
    fn the_front_has_what_no_other_beats() {
        let points = [
            point(1.0, 2.0),
            point(2.0, 1.0),
            point(2.0, 1.5),
            point(3.0, 1.0),
            point(2.0, 1.0),
        ];
        assert_eq!(pareto(&points), [true, true, false, false, true]);
        assert!(pareto(&[]).is_empty());
    }

    #[test]
    fn the_cheapest_one_that_surely_reaches_the_target_is_chosen() {
        let points = [
            point(1.0, 2.0),
            point(5.0, 0.4),
            point(2.0, 0.95),
            point(3.0, 0.9),
        ];
        assert_eq!(choose(&points, 5.0), Ok(0));
        assert_eq!(choose(&points, 1.0), Ok(3));
        let unsure = choose(&points, 0.42)
            .expect_err("0.44 % at most")
            .to_string();
        assert!(unsure.contains("--seeds"), "{unsure}");
        assert!(matches!(choose(&points, 0.2), Err(Missed::NotReached(_))));
        assert_eq!(choose(&[], 1.0), Err(Missed::NothingMeasured));
    }
}
