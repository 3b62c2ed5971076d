//! What light that is scattered goes by, and the far field that stands for all beyond the sphere.

use crate::exchange::{Exchange, ExchangeError, FarRows, Outlook, ThisProcess};
use crate::frame::Frame;
use crate::plan::TracePlan;
use crate::progress::Progress;
use crate::run::Run;
use crate::solve_error::SolveError;
use crate::solver::{Groups, Sampled};

/// What light that is scattered goes by; not there where nothing was to be scattered.
pub(super) struct Scattering {
    pub(super) exchange: Exchange,
    pub(super) outlook: Outlook,
    pub(super) groups: Groups,
    pub(super) far: Option<Far>,
}

/// The far field, and what it is judged by.
pub(super) struct Far {
    pub(super) rows: FarRows,
    pub(super) within: Look,
    pub(super) without_end: Look,
}

/// The exchange by a few lines.
pub(super) struct Look {
    pub(super) exchange: Exchange,
    pub(super) outlook: Outlook,
}

impl Scattering {
    /// Bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let looks = self
            .far
            .iter()
            .flat_map(|far| [&far.within, &far.without_end]);
        let looks = looks.map(|look| look.exchange.bytes() + look.outlook.bytes());
        let far = self.far.as_ref().map_or(0, |far| far.rows.bytes());
        let own = self.exchange.bytes() + self.outlook.bytes() + self.groups.bytes();
        own + far + looks.sum::<u64>()
    }
}

impl Far {
    /// What stands for all beyond the sphere, where there is one.
    pub(super) fn trace(
        frame: &Frame,
        plan: &TracePlan,
        run: &Run,
    ) -> Result<Option<Self>, SolveError> {
        let Some((far, sampling)) = plan.far_field.zip(plan.sampling) else {
            return Ok(None);
        };
        let rows = FarRows::trace(frame, &far.sampling, run.stop)?;
        // by a few lines, within the sphere and without end
        let few = sampling.glance();
        let uncounted = Progress::default();
        let run = Run {
            progress: &uncounted,
            ..*run
        };
        let look = |rows: ThisProcess| {
            let exchange = Exchange::trace(frame, &few, &rows, &run)?;
            let outlook = Outlook::of(frame, &exchange);
            Ok::<_, ExchangeError>(Look { exchange, outlook })
        };
        Ok(Some(Self {
            rows,
            within: look(ThisProcess::default())?,
            without_end: look(ThisProcess::without_end())?,
        }))
    }
}

impl Look {
    pub(super) fn sampled<'a>(&'a self, outlook: &'a Outlook) -> Sampled<'a> {
        Sampled {
            exchange: &self.exchange,
            outlook,
        }
    }
}
