//! Planted mistakes, for testing the tests: the feature `mistakes` and the environment variable `PATHSPACE_MISTAKE` choose one.
//!
//! Without the feature there is nothing here but a macro that expands to the right expression: no branch, no name.
//! `examples/mistakes.rs` plants one after the other and says which test noticed.

/// `mistake!(right, Name => wrong)`: the expression `right`, and with the feature `wrong` where the mistake `Name` was chosen.
#[cfg(not(feature = "mistakes"))]
macro_rules! mistake {
    ($right:expr, $name:ident => $wrong:expr) => {
        $right
    };
}

#[cfg(feature = "mistakes")]
macro_rules! mistake {
    ($right:expr, $name:ident => $wrong:expr) => {
        if crate::mistake::is_planted(crate::mistake::Mistake::$name) { $wrong } else { $right }
    };
}

#[cfg(feature = "mistakes")]
mod list;

#[cfg(feature = "mistakes")]
pub use self::chosen::{UnknownMistake, VARIABLE, check, is_planted};
#[cfg(feature = "mistakes")]
pub use self::list::Mistake;

#[cfg(feature = "mistakes")]
mod chosen {
    use std::{env, sync::LazyLock};

    use super::Mistake;

    /// The environment variable that names the planted mistake.
    pub const VARIABLE: &str = "PATHSPACE_MISTAKE";

    /// The variable names no mistake.
    #[derive(Clone, Debug, thiserror::Error)]
    #[error(
        "PATHSPACE_MISTAKE: there is no mistake '{0}'; cargo run --release --example mistakes -- --list names them all"
    )]
    pub struct UnknownMistake(String);

    /// Read once: it is asked for in the hottest loops.
    static CHOSEN: LazyLock<Result<Option<Mistake>, UnknownMistake>> = LazyLock::new(|| match env::var_os(VARIABLE) {
        None => Ok(None),
        Some(name) => match name.to_str().and_then(Mistake::named) {
            Some(mistake) => Ok(Some(mistake)),
            None => Err(UnknownMistake(name.to_string_lossy().into_owned())),
        },
    });

    /// Whether the variable is absent or names a mistake.
    ///
    /// # Errors
    /// If it names none.
    pub fn check() -> Result<(), UnknownMistake> {
        CHOSEN.clone().map(|_| ())
    }

    /// Whether this mistake was chosen.
    ///
    /// # Panics
    /// If the variable names no mistake.
    #[inline]
    pub fn is_planted(mistake: Mistake) -> bool {
        match &*CHOSEN {
            Ok(chosen) => *chosen == Some(mistake),
            Err(unknown) => panic!("{unknown}"),
        }
    }
}
