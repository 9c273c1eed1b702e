//! Which of a file's scenes is shown.

use gltf_json::{Index, Root};

use super::error::{LoadError, one_line, quoted};

/// Makes the scene that `wanted` names, or numbers, the one that the file shows.
///
/// Without a wish it is the file's default or the first, with a warning if there are others.
pub(super) fn choose(
    root: &mut Root,
    wanted: Option<&str>,
    file: &str,
    warnings: &mut Vec<String>,
) -> Result<(), LoadError> {
    let count = root.scenes.len();
    let Some(wanted) = wanted else {
        if count > 1 {
            let which = if root.scene.is_some() { "its default" } else { "the first" };
            let index = root.scene.map_or(0, |scene| scene.value());
            warnings.push(format!("the file has {count} scenes: {which} (scene {index}) is shown"));
        }
        return Ok(());
    };
    // A name goes first: it was given by a person.
    let named = root.scenes.iter().position(|scene| scene.name.as_deref() == Some(wanted));
    let index = named.or_else(|| wanted.parse().ok().filter(|&index| index < count)).ok_or_else(|| {
        let wanted = quoted(wanted);
        LoadError::NoSuchScene { file: file.to_owned(), what: format!("there is no scene {wanted}: {}", list(root)) }
    })?;
    root.scene = Some(Index::new(index as u32));
    Ok(())
}

/// The scenes' names, where they have one.
pub(super) fn names(root: &Root) -> Vec<Option<String>> {
    root.scenes.iter().map(|scene| scene.name.as_deref().map(one_line)).collect()
}

/// The scene that is shown, if the file has any.
pub(super) fn shown(root: &Root) -> Option<usize> {
    (!root.scenes.is_empty()).then(|| root.scene.map_or(0, |scene| scene.value()))
}

fn list(root: &Root) -> String {
    /// More would be no sentence.
    const MOST: usize = 20;
    let one = |(index, scene): (usize, &gltf_json::Scene)| match &scene.name {
        Some(name) => format!("{index} {}", quoted(name)),
        None => index.to_string(),
    };
    let scenes: Vec<_> = root.scenes.iter().enumerate().map(one).take(MOST).collect();
    match root.scenes.len() {
        0 => "the file has none".to_owned(),
        more @ MOST.. if more > MOST => format!("the file has {}, and {} more", scenes.join(", "), more - MOST),
        _ => format!("the file has {}", scenes.join(", ")),
    }
}
