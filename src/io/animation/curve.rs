//! The value of an animated property between its keys (glTF 2.0 specification, appendix C).

use glam::DQuat;
use gltf_json::{Root, accessor::Type, animation::Interpolation, validation::Checked};

use super::{
    super::{
        accessor::{self, Accessors},
        error::Fault,
    },
    property::Kind,
    target::Target,
};

/// The keys of a property, in f64 from here on.
#[derive(Debug)]
pub(super) struct Curve {
    /// Finite and never decreasing; at least one.
    times: Vec<f64>,
    /// `width` numbers for each key; with tangents three times as many: in, value, out.
    values: Vec<f64>,
    width: usize,
    between: Between,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Between {
    Step,
    Linear,
    /// Along the shortest great arc.
    Spherical,
    Cubic,
    /// As before, then brought to unit length.
    CubicUnit,
}

impl Between {
    /// The elements of the output for each key.
    fn elements(self) -> usize {
        if matches!(self, Self::Cubic | Self::CubicUnit) { 3 } else { 1 }
    }
}

impl Curve {
    /// Reads the sampler of a target that is a property of this kind.
    pub(super) fn read(root: &Root, accessors: Accessors<'_>, target: &Target, kind: Kind) -> Result<Self, Fault> {
        let sampler = root.animations.get(target.animation()).and_then(|a| a.samplers.get(target.sampler));
        let sampler = sampler.ok_or_else(|| target.fault("its sampler is not there"))?;
        let between = match (&sampler.interpolation, kind) {
            (Checked::Valid(Interpolation::Step), _) => Between::Step,
            (_, Kind::Flag) => return Err(Fault::invalid(target.sampler_pointer(), "true and false have steps only")),
            (Checked::Valid(Interpolation::CubicSpline), Kind::Rotation) => Between::CubicUnit,
            (Checked::Valid(Interpolation::CubicSpline), _) => Between::Cubic,
            (_, Kind::Rotation) => Between::Spherical,
            _ => Between::Linear,
        };
        let times: Vec<_> = accessors.scalars(sampler.input)?.into_iter().map(f64::from).collect();
        let at = accessor::pointer(sampler.input);
        if times.is_empty() {
            return Err(Fault::invalid(at, "an animation has no keys here"));
        }
        if let Some(i) = times.iter().position(|time| !time.is_finite()) {
            return Err(Fault::invalid(at, format!("the time in element {i} is not finite: {}", times[i])));
        }
        if let Some(i) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            let what = format!("the times of an animation decrease from {} to {}", times[i], times[i + 1]);
            return Err(Fault::invalid(at, format!("{what} in element {}", i + 1)));
        }
        let (keys, at) = (times.len() * between.elements(), accessor::pointer(sampler.output));
        let values: Vec<_> = accessors.samples(sampler.output, kind.layout())?.into_iter().map(f64::from).collect();
        let width = match kind {
            Kind::Weights if values.len().is_multiple_of(keys) => values.len() / keys,
            Kind::Weights => 0,
            _ => kind.width(),
        };
        if width == 0 || values.len() != keys * width {
            let (elements, one) = (values.len() / kind.width(), if between.elements() == 3 { "three" } else { "one" });
            let each = if matches!(kind, Kind::Weights) { " for each morph target" } else { "" };
            let what = format!("an animation has {elements} values for {} keys, not {one} each{each}", times.len());
            return Err(Fault::invalid(at, what));
        }
        if let Some(i) = values.iter().position(|value| !value.is_finite()) {
            let what =
                format!("the value in element {} of an animation is not finite: {}", i / kind.width(), values[i]);
            return Err(Fault::invalid(at, what));
        }
        Ok(Self { times, values, width, between })
    }

    /// The value at a time; before the first key that of the first, after the last that of the last. `None` if it is
    /// beyond all numbers.
    ///
    /// The time is f32 as those of keys are: a frame that lies on a key is then on it, and not a rounding before it.
    pub(super) fn at(&self, seconds: f32) -> Option<Vec<f64>> {
        let time = f64::from(seconds);
        let after = self.times.partition_point(|&key| key <= time);
        let value = if after == 0 {
            self.key(0).to_vec()
        } else if after == self.times.len() || self.between == Between::Step {
            self.key(after - 1).to_vec()
        } else {
            self.within(after - 1, time)
        };
        value.iter().all(|x| x.is_finite()).then_some(value)
    }

    /// The value between key `k` and the next.
    fn within(&self, k: usize, time: f64) -> Vec<f64> {
        let duration = self.times[k + 1] - self.times[k];
        let t = (time - self.times[k]) / duration;
        let (from, to) = (self.key(k), self.key(k + 1));
        match self.between {
            Between::Step => from.to_vec(),
            Between::Linear => from.iter().zip(to).map(|(a, b)| (1.0 - t) * a + t * b).collect(),
            Between::Spherical => slerp(quaternion(from), quaternion(to), t).to_array().to_vec(),
            Between::Cubic => self.hermite(k, t, duration),
            Between::CubicUnit => quaternion(&self.hermite(k, t, duration)).to_array().to_vec(),
        }
    }

    /// Appendix C.5: v_t = (2t³ − 3t² + 1) v_k + d (t³ − 2t² + t) b_k + (−2t³ + 3t²) v_{k+1} + d (t³ − t²) a_{k+1}.
    fn hermite(&self, k: usize, t: f64, duration: f64) -> Vec<f64> {
        let (t2, t3) = (t * t, t * t * t);
        let (from, out_of) = (self.element(3 * k + 1), self.element(3 * k + 2));
        let (into, to) = (self.element(3 * k + 3), self.element(3 * k + 4));
        let component = |i: usize| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * from[i]
                + duration * (t3 - 2.0 * t2 + t) * out_of[i]
                + (3.0 * t2 - 2.0 * t3) * to[i]
                + duration * (t3 - t2) * into[i]
        };
        (0..self.width).map(component).collect()
    }

    /// The value of a key.
    fn key(&self, k: usize) -> &[f64] {
        self.element(if self.between.elements() == 3 { 3 * k + 1 } else { k })
    }

    fn element(&self, i: usize) -> &[f64] {
        &self.values[i * self.width..(i + 1) * self.width]
    }
}

/// The rotation of these numbers, of unit length: exporters round them. Zeros, which are no rotation, stay, and are
/// refused with the node.
fn quaternion(numbers: &[f64]) -> DQuat {
    let q = DQuat::from_slice(numbers);
    if q.length_squared() > 0.0 { q.normalize() } else { q }
}

/// Appendix C.4, for unit quaternions.
fn slerp(from: DQuat, to: DQuat, t: f64) -> DQuat {
    /// Radians; below, the arc cannot be told from its chord.
    const SMALL: f64 = 1e-6;
    let cos = from.dot(to);
    let to = if cos < 0.0 { -to } else { to };
    let angle = cos.abs().min(1.0).acos();
    if angle < SMALL {
        return from * (1.0 - t) + to * t;
    }
    (from * (angle * (1.0 - t)).sin() + to * (angle * t).sin()) / angle.sin()
}

impl Kind {
    /// The type of its output accessor.
    fn layout(self) -> Type {
        match self {
            Self::Numbers(2) => Type::Vec2,
            Self::Numbers(3) => Type::Vec3,
            Self::Numbers(4) | Self::Rotation => Type::Vec4,
            Self::Numbers(_) | Self::Weights | Self::Flag => Type::Scalar,
        }
    }

    /// The numbers of an element of it.
    fn width(self) -> usize {
        self.layout().multiplicity()
    }
}

#[cfg(test)]
mod tests;
