//! What can be wrong with a file, each said in one sentence: what, where, and what to do.

pub(super) use crate::text::one_line;

/// Why a scene could not be read. Its message is one line; text from the file is escaped and shortened in it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// The file itself cannot be read.
    #[error("cannot read {file}: {reason}; check the name and its permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// What the operating system says.
        reason: String,
    },
    /// The GLB container is damaged.
    #[error("{file}, byte {offset}: {what}; it is no whole GLB 2.0 file, download or export it again")]
    Container {
        /// The file.
        file: String,
        /// Where in the file, in bytes from its start.
        offset: usize,
        /// What is wrong there.
        what: String,
    },
    /// The JSON is not JSON, or not that of a glTF 2.0 document.
    #[error("{file}, line {line}, column {column} of its JSON: {what}; it is no glTF 2.0 document, export it again")]
    Json {
        /// The file.
        file: String,
        /// The line in the JSON text, from 1.
        line: usize,
        /// The column, from 1.
        column: usize,
        /// What is wrong there.
        what: String,
    },
    /// A value that glTF 2.0 does not allow.
    #[error("{file}, {pointer}: {what}; repair the file or export it again")]
    Invalid {
        /// The file.
        file: String,
        /// The JSON pointer of the value.
        pointer: String,
        /// What is wrong with it.
        what: String,
    },
    /// Something that the file requires and this version does not do.
    #[error("{file}, {pointer}: {what}; export it without that")]
    Unsupported {
        /// The file.
        file: String,
        /// The JSON pointer of the requirement.
        pointer: String,
        /// What is required.
        what: String,
    },
    /// The scene that was asked for is not in the file.
    #[error("{file}: {what}")]
    NoSuchScene {
        /// The file.
        file: String,
        /// What was asked for, and what there is.
        what: String,
    },
    /// The variant of materials that was asked for is not in the file.
    #[error("{file}: {what}")]
    NoSuchVariant {
        /// The file.
        file: String,
        /// What was asked for, and what there is.
        what: String,
    },
    /// The animation that was asked for is not in the file.
    #[error("{file}: {what}")]
    NoSuchAnimation {
        /// The file.
        file: String,
        /// What was asked for, and what there is.
        what: String,
    },
    /// More than memory is meant to hold, refused before any is taken.
    #[error("{file}, {pointer}: {what}; simplify the model or split the file")]
    TooLarge {
        /// The file.
        file: String,
        /// The JSON pointer of the size.
        pointer: String,
        /// How large it is, and the limit.
        what: String,
    },
    /// A buffer or image that lies outside of the file cannot be had.
    #[error("{file}, {pointer}: {what}; keep a model and its files in one folder")]
    Resource {
        /// The file.
        file: String,
        /// The JSON pointer of the reference.
        pointer: String,
        /// What was looked for, and what happened.
        what: String,
    },
}

/// A [`LoadError`] before it knows its file: what the parts of the loader return.
#[derive(Debug)]
pub(super) struct Fault {
    reason: Reason,
    pointer: String,
    what: String,
}

#[derive(Debug)]
enum Reason {
    Invalid,
    Unsupported,
    TooLarge,
    Resource,
}

impl Fault {
    pub(super) fn invalid(pointer: impl Into<String>, what: impl AsRef<str>) -> Self {
        Self::new(Reason::Invalid, pointer, what)
    }

    pub(super) fn unsupported(pointer: impl Into<String>, what: impl AsRef<str>) -> Self {
        Self::new(Reason::Unsupported, pointer, what)
    }

    pub(super) fn too_large(pointer: impl Into<String>, what: impl AsRef<str>) -> Self {
        Self::new(Reason::TooLarge, pointer, what)
    }

    pub(super) fn resource(pointer: impl Into<String>, what: impl AsRef<str>) -> Self {
        Self::new(Reason::Resource, pointer, what)
    }

    fn new(reason: Reason, pointer: impl Into<String>, what: impl AsRef<str>) -> Self {
        Self { reason, pointer: pointer.into(), what: one_line(what.as_ref()) }
    }

    /// The error, in this file.
    pub(super) fn at(self, file: &str) -> LoadError {
        let Self { reason, pointer, what } = self;
        let file = file.to_owned();
        match reason {
            Reason::Invalid => LoadError::Invalid { file, pointer, what },
            Reason::Unsupported => LoadError::Unsupported { file, pointer, what },
            Reason::TooLarge => LoadError::TooLarge { file, pointer, what },
            Reason::Resource => LoadError::Resource { file, pointer, what },
        }
    }
}

/// A string from the file, quoted, on one line and at most 60 characters long.
pub(super) fn quoted(text: &str) -> String {
    let mut short: String = text.chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("“{}”", one_line(&short))
}
