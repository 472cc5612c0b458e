//! The progress bar.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar on stderr with the time left; silent where stderr is not a terminal.
pub(super) fn progress_bar(total: u64, quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let style = ProgressStyle::with_template(
        "{percent:>3}% [{wide_bar}] {human_pos} of {human_len} samples, {elapsed} elapsed, {eta} left",
    )
    .expect("the template is valid");
    bar.set_style(style.progress_chars("=> "));
    bar
}

/// A message about work whose end nobody knows, on stderr; silent where that is not a terminal.
pub(super) fn spinner(quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(None, target);
    let style =
        ProgressStyle::with_template("{spinner} {msg}, {elapsed} elapsed").expect("the template is valid");
    bar.set_style(style);
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}
