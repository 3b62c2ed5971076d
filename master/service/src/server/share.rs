//! What one client may have of something that all share.

/// What is there of something, who has it, and what is wanted of it besides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// All that there is.
    pub(super) limit: u64,
    /// What the client has that wants more.
    pub(super) own: u64,
    /// What all others have.
    pub(super) others: u64,
}

impl Share {
    /// Whether the client may have so much more: half of what the others leave. Whoever has nothing may have all
    /// that is left, for a half may be too small for anything.
    pub(super) fn allows(&self, more: u64) -> bool {
        let left = self.limit.saturating_sub(self.others);
        let wanted = self.own.saturating_add(more);
        wanted <= if self.own == 0 { left } else { left / 2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_takes_much_leaves_something_to_the_next() {
        let mut taken = Vec::new();
        for _ in 0..5 {
            let (mut own, others) = (0, taken.iter().sum());
            while (Share {
                limit: 1000,
                own,
                others,
            })
            .allows(1)
            {
                own += 1;
            }
            taken.push(own);
        }
        assert_eq!(taken, [500, 250, 125, 62, 31]);
    }

    #[test]
    fn one_thing_is_had_even_where_a_half_would_be_too_small() {
        let share = |own, others| Share {
            limit: 10,
            own,
            others,
        };
        assert!(share(0, 0).allows(10) && share(0, 9).allows(1));
        assert!(!share(0, 0).allows(11) && !share(0, 10).allows(1) && !share(4, 0).allows(2));
        assert!(!share(1, 0).allows(u64::MAX) && !share(0, 20).allows(1));
    }
}
