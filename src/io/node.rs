//! The node hierarchy: who is in the scene, and where.

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf_json::{Index, Node, Root};

use serde_json::Value;

use super::{
    error::Fault,
    far,
    limits::Limit,
    placed::{FARTHEST, Placed, is_near},
};

/// Every node of the scene, parents before children. Nothing recurses, so no depth of nesting can exhaust the stack;
/// `depth` is the most there may be, `exact` what [`far::exact`] gives.
pub(super) fn hierarchy(
    root: &Root,
    exact: &[Value],
    depth: u64,
    warnings: &mut Vec<String>,
) -> Result<Vec<Placed>, Fault> {
    let parents = parents(root)?;
    let mut placed = Vec::new();
    let mut stack: Vec<_> =
        roots(root, &parents, warnings)?.into_iter().rev().map(|i| (i, 1, DAffine3::IDENTITY, true)).collect();
    while let Some((index, level, parent, visible)) = stack.pop() {
        if level > depth {
            let what = format!("the node lies deeper than others, and {}", Limit("depth", depth));
            return Err(Fault::too_large(format!("/nodes/{index}"), what));
        }
        let Some(node) = root.nodes.get(index) else { continue };
        let to_world = parent * local(node, exact.get(index), index)?;
        if !to_world.is_finite() || !is_near(to_world.translation.as_vec3()) {
            let what =
                format!("the node's transform to world space is not finite, or farther than {FARTHEST:e} m away");
            return Err(Fault::invalid(format!("/nodes/{index}"), what));
        }
        let visible = visible && is_visible(node, index)?;
        stack.extend(children(node).rev().map(|child| (child, level + 1, to_world, visible)));
        placed.push(Placed { index, to_world, visible });
    }
    Ok(placed)
}

/// What the node itself says (`KHR_node_visibility`); what is below an invisible one is not there either.
fn is_visible(node: &Node, index: usize) -> Result<bool, Fault> {
    const NAME: &str = "KHR_node_visibility";
    match node.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)?.get("visible")) {
        None => Ok(true),
        Some(Value::Bool(visible)) => Ok(*visible),
        Some(_) => {
            Err(Fault::invalid(format!("/nodes/{index}/extensions/{NAME}/visible"), "this is neither true nor false"))
        }
    }
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(Index::value)
}

/// The parent of each node, after showing that the nodes form trees.
fn parents(root: &Root) -> Result<Vec<Option<usize>>, Fault> {
    let mut parents: Vec<Option<usize>> = vec![None; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        for (k, child) in children(node).enumerate() {
            match parents.get_mut(child) {
                Some(parent @ None) => *parent = Some(i),
                Some(Some(other)) => {
                    let what = format!("node {child} is a child of node {other} too, or twice of this one");
                    return Err(Fault::invalid(format!("/nodes/{i}/children/{k}"), what));
                }
                None => {
                    return Err(Fault::invalid(
                        format!("/nodes/{i}/children/{k}"),
                        format!("there is no node {child}"),
                    ));
                }
            }
        }
    }
    // Walk up from every node until a node known to lead to a root; a walk that meets itself is a cycle.
    let mut seen = vec![usize::MAX; root.nodes.len()];
    for start in 0..parents.len() {
        let mut at = Some(start);
        while let Some(i) = at.filter(|&i| seen[i] == usize::MAX) {
            seen[i] = start;
            at = parents[i];
        }
        if let Some(i) = at.filter(|&i| seen[i] == start) {
            return Err(Fault::invalid(format!("/nodes/{i}"), "the node is its own ancestor"));
        }
    }
    Ok(parents)
}

/// The roots of the scene to show: `scene`, or the first one, or every parentless node of a file without scenes.
fn roots(root: &Root, parents: &[Option<usize>], warnings: &mut Vec<String>) -> Result<Vec<usize>, Fault> {
    let index = root.scene.map_or(0, |scene| scene.value());
    let Some(scene) = root.scenes.get(index) else {
        if !parents.is_empty() {
            warnings.push("the file has no scene: all of its nodes are shown".to_owned());
        }
        return Ok((0..parents.len()).filter(|&i| parents[i].is_none()).collect());
    };
    let mut listed = vec![false; parents.len()];
    for (k, node) in scene.nodes.iter().map(Index::value).enumerate() {
        let at = || format!("/scenes/{index}/nodes/{k}");
        match (listed.get_mut(node), parents.get(node)) {
            (Some(true), _) => return Err(Fault::invalid(at(), format!("node {node} is listed twice"))),
            (_, Some(Some(parent))) => {
                let what = format!("node {node} is a child of node {parent} and cannot be a root of the scene");
                return Err(Fault::invalid(at(), what));
            }
            (Some(listed), _) => *listed = true,
            (None, _) => return Err(Fault::invalid(at(), format!("there is no node {node}"))),
        }
    }
    Ok(scene.nodes.iter().map(Index::value).collect())
}

/// The node's own transform: a matrix, or translation · rotation · scale.
fn local(node: &Node, exact: Option<&Value>, index: usize) -> Result<DAffine3, Fault> {
    let fail = |member: &str, what: &str| Fault::invalid(format!("/nodes/{index}/{member}"), what);
    if let Some(matrix) = node.matrix {
        if !matrix.iter().all(|x| x.is_finite()) {
            return Err(fail("matrix", "the matrix is not finite"));
        }
        let matrix = DMat4::from_cols_array(&far::numbers(exact, "matrix", matrix));
        if (matrix.row(3) - DVec3::ZERO.extend(1.0)).abs().max_element() > 1e-6 {
            return Err(fail("matrix", "the last row of the matrix is not 0 0 0 1"));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let vector = |v: Option<[f32; 3]>, member: &str, default: DVec3| {
        v.map_or(default, |v| DVec3::from(far::numbers(exact, member, v)))
    };
    let scale = vector(node.scale, "scale", DVec3::ONE);
    let translation = vector(node.translation, "translation", DVec3::ZERO);
    let rotation = |r: [f32; 4]| DQuat::from_array(far::numbers(exact, "rotation", r));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |r| rotation(r.0));
    if !scale.is_finite() || !translation.is_finite() || !rotation.is_finite() {
        return Err(fail("scale", "the node's translation, rotation or scale is not finite"));
    }
    if rotation.length_squared() < 1e-12 {
        return Err(fail("rotation", "the rotation is no unit quaternion"));
    }
    // Exporters round the quaternion; its direction is what they mean.
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}
