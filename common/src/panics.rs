//! Panics: faults of the program, or of a library. They are caught where a thread begins, so that what it was to do
//! fails with a reason.

use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::sync::Once;
use std::thread;

use thiserror::Error;

/// A panic that was caught.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{words}")]
pub struct Panic {
    words: String,
}

/// Runs what may panic. The panic is shown where all panics are.
pub fn caught<T>(what: impl FnOnce() -> T) -> Result<T, Panic> {
    catch_unwind(AssertUnwindSafe(what)).map_err(|payload| Panic::of(&*payload))
}

/// Runs what may panic where that says nothing of this program, such as a library that reads a damaged file: the
/// panic is shown nowhere.
pub fn caught_silently<T>(what: impl FnOnce() -> T) -> Result<T, Panic> {
    static HOOKED: Once = Once::new();
    HOOKED.call_once(|| {
        let shown = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !SILENT.get() {
                shown(panic);
            }
        }));
    });
    let before = SILENT.replace(true);
    let done = caught(what);
    SILENT.set(before);
    done
}

/// Has panics told as lines of text from now on, instead of written to stderr.
pub fn tell(how: impl Fn(&str) + Send + Sync + 'static) {
    panic::set_hook(Box::new(move |panic| {
        if SILENT.get() {
            return;
        }
        let thread = thread::current();
        let name = thread.name().unwrap_or("without a name").to_owned();
        let place = panic.location().map(ToString::to_string);
        let words = words(panic.payload());
        how(&format!(
            "thread '{name}' panicked at {}: {words}",
            place.unwrap_or_default()
        ));
    }));
}

thread_local! {
    /// Panics of this thread are not shown.
    static SILENT: Cell<bool> = const { Cell::new(false) };
}

impl Panic {
    /// What was thrown.
    pub fn of(payload: &(dyn Any + Send)) -> Self {
        Self {
            words: words(payload).to_owned(),
        }
    }
}

fn words(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("without a message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_panic_says_is_its_error() {
        let words = |what: fn()| caught_silently(what).unwrap_err().to_string();
        assert_eq!(words(|| panic!("row {}", 7)), "row 7");
        assert_eq!(words(|| panic!("no rows")), "no rows");
        assert_eq!(words(|| panic::panic_any(3)), "without a message");
        assert_eq!(caught(|| 4), Ok(4));
    }
}
