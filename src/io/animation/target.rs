//! What the channels of animations move, and by which samplers.

use gltf_json::Root;
use serde_json::Value;

use super::super::error::Fault;

/// What a channel moves.
pub(super) struct Target {
    /// The animation, and the channel in it.
    animation: usize,
    channel: usize,
    /// The sampler in the animation, which is there.
    pub(super) sampler: usize,
    /// The JSON pointer of the property.
    pub(super) pointer: String,
}

impl Target {
    /// What is wrong with the channel.
    pub(super) fn fault(&self, what: impl AsRef<str>) -> Fault {
        Fault::invalid(format!("/animations/{}/channels/{}", self.animation, self.channel), what)
    }

    /// The JSON pointer of the sampler.
    pub(super) fn sampler_pointer(&self) -> String {
        format!("/animations/{}/samplers/{}", self.animation, self.sampler)
    }

    pub(super) fn animation(&self) -> usize {
        self.animation
    }
}

/// The targets of each animation. They are read from the JSON: gltf-json knows those of nodes alone.
pub(super) fn all(animations: Option<&Value>, root: &Root) -> Result<Vec<Vec<Target>>, Fault> {
    let json = animations.and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let mut all = Vec::with_capacity(root.animations.len());
    for (a, animation) in root.animations.iter().enumerate() {
        let channels = json.get(a).and_then(|animation| animation.get("channels")?.as_array());
        let mut targets = Vec::new();
        for (c, channel) in channels.into_iter().flatten().enumerate() {
            let at = format!("/animations/{a}/channels/{c}");
            let Some(pointer) = pointer(channel, root.nodes.len(), &at)? else { continue };
            let sampler = index(channel.get("sampler")).filter(|&sampler| sampler < animation.samplers.len());
            let sampler = sampler.ok_or_else(|| {
                Fault::invalid(format!("{at}/sampler"), "this index points to no sampler of the animation")
            })?;
            targets.push(Target { animation: a, channel: c, sampler, pointer });
        }
        all.push(targets);
    }
    Ok(all)
}

/// The property that a channel moves, as a JSON pointer. `None` for what only other extensions know.
fn pointer(channel: &Value, nodes: usize, at: &str) -> Result<Option<String>, Fault> {
    let target = channel.get("target");
    let path = target.and_then(|target| target.get("path")?.as_str()).unwrap_or_default();
    if path == "pointer" {
        let extensions = target.and_then(|target| target.get("extensions"));
        let pointer = extensions.and_then(|all| all.get("KHR_animation_pointer")?.get("pointer")?.as_str());
        return pointer.map(|pointer| Some(pointer.to_owned())).ok_or_else(|| {
            let at = format!("{at}/target/extensions/KHR_animation_pointer/pointer");
            Fault::invalid(at, "there is no pointer to what the channel animates")
        });
    }
    let Some(node) = target.and_then(|target| target.get("node")) else { return Ok(None) };
    match index(Some(node)).filter(|&node| node < nodes) {
        Some(node) => Ok(Some(format!("/nodes/{node}/{path}"))),
        None => Err(Fault::invalid(format!("{at}/target/node"), "this index points to no node of the file")),
    }
}

fn index(value: Option<&Value>) -> Option<usize> {
    value?.as_u64().and_then(|index| usize::try_from(index).ok())
}
