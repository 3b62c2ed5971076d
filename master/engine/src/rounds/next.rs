//! What to plan the next round for: pure arithmetic on what the last one measured.

use super::allot::{OF_LIGHT, allot, allot_to_light};
use super::work::{PARTS, PerPart};
use crate::plan::Aims;
use crate::solution::BandAccount;

/// A round, as the next one is planned from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    /// What it was planned for.
    pub(super) aims: Aims,
    /// Planning for a larger error than this would have made its exchange no coarser.
    pub(super) coarsest_exchange_percent: f64,
    /// What came of it, by band.
    pub(super) errors: &'a [BandAccount],
    /// Which parts no plan makes finer.
    pub(super) fixed: [bool; PARTS],
    /// What each part took, roughly, s.
    pub(super) cost_s: PerPart,
}

/// The next round aims a bit lower than it must: errors of errors.
const AIM: f64 = 0.85;

/// No part is planned finer than the last time by more than this: the cost grows with its square. Elements that are
/// uncut triangles tell less of smaller ones, and so do soil cells.
const MOST_FINER: PerPart = [10.0, 10.0, 10.0, 3.5, 3.5];

/// The square of what can be planned for is not brought below this part of the square of what cannot, or of what is
/// aimed at where that is more: it would have to be far finer, and the whole hardly better. And not below what is
/// aimed at, which is all that was asked of it.
const LEAST_LEFT: f64 = 0.3;

impl Measured<'_> {
    /// By how much each part has to err less; none where no plan helps, because what cannot be planned for is nearly
    /// all that is left.
    pub(super) fn finer(&self, asked_percent: f64) -> Option<PerPart> {
        // the solver is as much finer as the exchange
        let without_solver = self.finer_with(asked_percent, 0.0);
        let without_solver = without_solver.unwrap_or([1.0; PARTS]);
        let solver = self.aims(&without_solver).exchange_percent / self.aims.exchange_percent;
        self.finer_with(asked_percent, solver)
    }

    /// The same where so much of the solver's error is left.
    fn finer_with(&self, asked_percent: f64, solver: f64) -> Option<PerPart> {
        let aimed = AIM * asked_percent;
        let mut bands = Vec::new();
        let mut misses = false;
        for band in self.errors {
            let parts = self.parts(band).map(|e| e * e);
            let (sum, fixed) = (parts.iter().sum::<f64>(), self.fixed_square(band));
            let reachable = (aimed - solver * band.solver_percent).max(0.0).powi(2) - fixed;
            let least = (LEAST_LEFT * fixed.max(aimed * aimed)).min(aimed * aimed);
            let left = if reachable >= least {
                reachable
            } else if sum <= least / (AIM * AIM) {
                // as good as it gets
                sum
            } else {
                least
            };
            misses |= sum > left;
            if left > 0.0 {
                bands.push(parts.map(|square| square / left));
            }
        }
        if !misses {
            return None;
        }
        let all = allot(&bands, &self.cost_s);
        let factors = match allot_to_light(&bands, &self.cost_s) {
            Some(light) if self.takes_s(&light, OF_LIGHT) < self.takes_s(&all, [true; PARTS]) => {
                light
            }
            _ => all,
        };
        Some(std::array::from_fn(|k| factors[k].max(1.0 / MOST_FINER[k])))
    }

    /// What parts take that err less by these factors, s.
    fn takes_s(&self, finer: &PerPart, parts: [bool; PARTS]) -> f64 {
        let of = |k: usize| self.cost_s[k] / (finer[k] * finer[k]);
        (0..PARTS).filter(|&k| parts[k]).map(of).sum()
    }

    /// The parts that can be planned for.
    fn parts(&self, parts: &BandAccount) -> PerPart {
        let all = all_parts(parts);
        std::array::from_fn(|k| if self.fixed[k] { 0.0 } else { all[k] })
    }

    /// The square of what cannot.
    fn fixed_square(&self, parts: &BandAccount) -> f64 {
        let fixed = all_parts(parts).into_iter().zip(self.fixed);
        let of_parts = fixed.filter(|(_, fixed)| *fixed).map(|(e, _)| e * e);
        of_parts.sum::<f64>() + parts.far_field_percent * parts.far_field_percent
    }

    /// The error of the worst band that a plan for other aims should have, percent.
    pub(super) fn predicted_percent(&self, next: &Aims) -> f64 {
        let last = Aims {
            exchange_percent: self
                .aims
                .exchange_percent
                .min(self.coarsest_exchange_percent),
            ..self.aims
        };
        let ratio: PerPart = {
            let (next, last) = (parts_of(next), parts_of(&last));
            std::array::from_fn(|k| {
                if self.fixed[k] {
                    1.0
                } else {
                    next[k] / last[k]
                }
            })
        };
        let of_band = |band: &BandAccount| {
            let all = all_parts(band);
            BandAccount {
                exchange_percent: ratio[0] * all[0],
                direct_percent: ratio[1] * all[1],
                sky_percent: ratio[2] * all[2],
                elements_percent: ratio[3] * all[3],
                soil_percent: ratio[4] * all[4],
                solver_percent: ratio[0] * band.solver_percent,
                ..band.clone()
            }
            .total_percent()
        };
        self.errors.iter().map(of_band).fold(0.0, f64::max)
    }

    /// The aims that go with errors smaller by these factors.
    pub(super) fn aims(&self, finer: &PerPart) -> Aims {
        let last = &self.aims;
        let exchange = if finer[0] < 1.0 {
            last.exchange_percent.min(self.coarsest_exchange_percent)
        } else {
            last.exchange_percent
        };
        Aims {
            exchange_percent: exchange * finer[0],
            direct_percent: last.direct_percent * finer[1],
            sky_percent: last.sky_percent * finer[2],
            elements_percent: last.elements_percent * finer[3],
            soil_percent: last.soil_percent * finer[4],
            ..*last
        }
        .not_below_the_least()
    }
}

/// The parts that plans are made for, whether or not there are finer ones.
fn all_parts(parts: &BandAccount) -> PerPart {
    [
        parts.exchange_percent,
        parts.direct_percent,
        parts.sky_percent,
        parts.elements_percent,
        parts.soil_percent,
    ]
}

/// What the parts of a plan are to err by.
fn parts_of(aims: &Aims) -> PerPart {
    [
        aims.exchange_percent,
        aims.direct_percent,
        aims.sky_percent,
        aims.elements_percent,
        aims.soil_percent,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(percent: PerPart) -> BandAccount {
        let [
            exchange_percent,
            direct_percent,
            sky_percent,
            elements_percent,
            soil_percent,
        ] = percent;
        BandAccount {
            exchange_percent,
            direct_percent,
            sky_percent,
            elements_percent,
            soil_percent,
            ..BandAccount::default()
        }
    }

    fn measured(errors: &[BandAccount]) -> Measured<'_> {
        Measured {
            aims: Aims::of(0.5),
            coarsest_exchange_percent: 0.7,
            errors,
            fixed: [false; PARTS],
            cost_s: [1.0, 0.5, 0.0, 0.5, 0.5],
        }
    }

    #[test]
    fn all_bands_are_brought_down_to_what_is_asked_for() {
        let errors = [
            parts([0.2, 0.9, 0.0, 0.1, 0.3]),
            parts([0.8, 0.1, 0.0, 0.9, 0.1]),
        ];
        let finer = measured(&errors).finer(0.5).unwrap();
        for band in &errors {
            let parts = measured(&errors).parts(band);
            let square: f64 = (0..PARTS).map(|k| (parts[k] * finer[k]).powi(2)).sum();
            assert!(
                square <= (AIM * 0.5).powi(2) * 1.000_001,
                "{square} {finer:?}"
            );
        }
        assert!(finer.iter().all(|&s| s <= 1.0), "{finer:?}");
        assert_eq!(finer[2], 1.0);
    }

    /// The exchange was made a little finer, and so traced again, where direct light alone was coarse.
    #[test]
    fn fault_what_was_traced_fine_enough_was_traced_again() {
        let errors = [parts([0.3, 4.0, 0.0, 0.48, 0.04])];
        let measured = Measured {
            cost_s: [3.0, 0.1, 0.0, 1.4, 0.0],
            ..measured(&errors)
        };
        let finer = measured.finer(0.9).unwrap();
        let kept = [finer[0], finer[3], finer[4]];
        assert!(kept == [1.0; 3] && finer[1] < 0.2, "{finer:?}");
        assert!(measured.aims(&finer).trace_as(&measured.aims));
        // where it errs too much, it is
        assert!(measured.finer(0.5).is_some_and(|finer| finer[3] < 1.0));
    }

    #[test]
    fn a_part_alone_has_all_of_the_error() {
        let errors = [parts([0.9, 0.0, 0.0, 0.0, 0.0])];
        let finer = measured(&errors).finer(0.5).unwrap();
        assert!((finer[0] - AIM * 0.5 / 0.9).abs() < 1e-9, "{finer:?}");
    }

    /// It was taken off as if it stayed: a look that left 0.07 % to the solver made the next round a third dearer.
    #[test]
    fn what_a_look_leaves_to_the_solver_is_not_left_by_the_next_round() {
        let look = BandAccount {
            solver_percent: 0.07,
            ..parts([2.0, 0.0, 0.0, 0.0, 0.0])
        };
        let finer = measured(&[look]).finer(0.5).unwrap();
        let left = AIM * 0.5 - 0.07 * finer[0];
        assert!((finer[0] * 2.0 / left - 1.0).abs() < 0.01, "{finer:?}");
    }

    #[test]
    fn what_cannot_be_planned_for_ends_it() {
        let far = BandAccount {
            far_field_percent: 3.0,
            ..parts([0.1; PARTS])
        };
        assert_eq!(measured(&[far]).finer(0.5), None);
    }

    /// Trees over a crop within a sphere, 0.5 % asked: direct light was 3.06 of 3.11 %, and there was no second round,
    /// because the far field alone was more than 0.36 %.
    #[test]
    fn what_a_plan_cannot_help_does_not_keep_it_from_helping_the_rest() {
        for far_field_percent in [0.3, 0.4, 0.5, 1.0, 3.0] {
            let of = |rest| BandAccount {
                far_field_percent,
                ..parts(rest)
            };
            let mut rest = [0.3, 3.06, 0.0, 0.1, 0.1];
            let mut rounds = 1;
            while of(rest).total_percent() > 0.5
                && let Some(finer) = measured(&[of(rest)]).finer(0.5)
            {
                // a bit more is left than was planned for
                rest = std::array::from_fn(|k| rest[k] * (1.1 * finer[k]).min(1.0));
                rounds += 1;
                assert!(rounds <= 3, "{rest:?}");
            }
            let square: f64 = rest.iter().map(|e| e * e).sum();
            // hardly more than it cannot help, and the rest no finer than that needs
            let total = of(rest).total_percent();
            assert!(
                total < (1.2 * far_field_percent).max(0.5),
                "{total} {rest:?}"
            );
            assert!(square > 0.29 * (AIM * 0.5).powi(2), "{rest:?}");
        }
    }

    #[test]
    fn a_band_that_nothing_helps_is_not_passed_over_for_one_that_is_noisier() {
        let far = BandAccount {
            far_field_percent: 2.3,
            ..parts([0.1; PARTS])
        };
        assert_eq!(measured(&[parts([0.6; PARTS]), far]).finer(2.0), None);
    }

    #[test]
    fn a_sky_that_has_no_more_directions_is_not_chased() {
        let errors = [parts([0.9, 0.0, 0.5, 0.0, 0.0])];
        let mut measured = measured(&errors);
        assert!(measured.finer(0.5).is_some_and(|finer| finer[2] < 1.0));
        measured.fixed[2] = true;
        assert!(measured.finer(0.5).is_some_and(|finer| finer[2] == 1.0));
        // what it leaves is for the others
        let finer = measured.finer(1.0).unwrap();
        assert!(finer[0] < 1.0 && finer[2] == 1.0, "{finer:?}");
    }

    #[test]
    fn an_error_is_predicted_in_proportion_to_what_is_aimed_at() {
        let errors = [
            parts([1.0, 0.5, 0.0, 0.5, 0.0]),
            parts([0.2, 0.1, 0.0, 0.1, 0.0]),
        ];
        let mut measured = measured(&errors);
        measured.aims.exchange_percent = 2.0;
        let same = measured.predicted_percent(&measured.aims);
        // twice as coarse a plan was not
        assert!(same > errors[0].total_percent());
        measured.coarsest_exchange_percent = f64::INFINITY;
        let same = measured.predicted_percent(&measured.aims);
        assert!((same - errors[0].total_percent()).abs() < 1e-12);
        let finer = [0.25, 0.5, 1.0, 0.5, 1.0];
        let next = measured.aims(&finer);
        let expected = parts([0.25, 0.25, 0.0, 0.25, 0.0]).total_percent();
        assert!((measured.predicted_percent(&next) - expected).abs() < 1e-12);
    }
}
