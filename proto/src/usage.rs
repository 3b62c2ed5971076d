//! What is said of a command line that is wrong, or asks for help.

use std::io::Write;

use nestrad_common::printable;

/// Says it, if it can be said: nothing can be done about a stderr or a stdout that is gone.
pub fn say(usage: &clap::Error) {
    let _ = if usage.use_stderr() {
        // with words of the command line, which may be names of files
        let text = usage.render().to_string();
        std::io::stderr().write_all(printable::lines(&text).as_bytes())
    } else {
        usage.print()
    };
}
