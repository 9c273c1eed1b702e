//! How surfaces scatter: one enum of BSDFs over one small interface.
//!
//! All directions are unit vectors in the *shading frame* (z is N_s) and point away from the surface. A BSDF never asks
//! which way a path is being built: [`Bsdf::eval`] takes the direction towards the camera and the one towards the
//! light, and returns the radiance-convention value with *both* densities. Only [`Bsdf::sample`] knows a [`Transport`].

mod albedo;
mod bsdfs;
mod dielectric;
mod diffuse;
mod directions;
mod emission;
mod fresnel;
mod functions;
mod glass;
mod layer;
mod layered;
mod metal;
mod metallic_roughness;
mod microfacet;
mod mirror;
mod pane;
#[cfg(test)]
mod tests;
mod thin;
mod transmitting;

use glam::Vec3;

use crate::{
    lanes::{Float, Lanes, One, Select, Vector},
    math::{Frame, Rgb},
    sampling::{PdfSolidAngle, warp},
};

pub use bsdfs::{Across, Bsdfs, Kind, Terms};
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use directions::Directions;
pub use emission::OverEmission;
pub use glass::Glass;
pub use layered::{Clear, Emission, Layered, Passage, SheenPlace, Surface};
pub use metal::Metal;
pub use metallic_roughness::MetallicRoughness;
pub use mirror::Mirror;
pub use pane::Pane;
pub use thin::ThinDielectric;

/// Which side a walk comes from, known to sampling only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// The walk began at the camera: the known direction points to the camera, the sampled one to the light.
    Radiance,
    /// The walk began at a light: the known direction points to the light, the sampled one to the camera.
    Importance,
}

impl Transport {
    /// (direction towards the camera, direction towards the light) from the known and the sampled direction.
    #[inline]
    pub fn sides<V>(self, known: V, sampled: V) -> (V, V) {
        match self {
            Self::Radiance => (known, sampled),
            Self::Importance => (sampled, known),
        }
    }
}

impl<L: Lanes> Scatter<L> {
    /// (density of the sampled direction, density of the known one given the sampled) for a walk.
    #[inline]
    pub fn forward_reverse(&self, transport: Transport) -> (PdfSolidAngle<L::F>, PdfSolidAngle<L::F>) {
        match transport {
            Transport::Radiance => (self.to_light, self.to_camera),
            Transport::Importance => (self.to_camera, self.to_light),
        }
    }

    /// [`Scatter::ZERO`] in all lanes.
    #[inline(always)]
    pub fn nothing(lanes: L) -> Self {
        let zero = lanes.splat(0.0);
        Self { f: Rgb::of(L::V::new(zero, zero, zero)), to_light: PdfSolidAngle(zero), to_camera: PdfSolidAngle(zero) }
    }

    /// The same where the condition holds, and elsewhere [`Scatter::ZERO`].
    #[inline(always)]
    #[must_use]
    pub fn only(self, which: L::M) -> Self {
        Self::select(which, self, Self::nothing(self.to_light.0.lanes()))
    }

    /// Two lobes together; each density already includes the probability of its lobe.
    ///
    /// Where neither passes any light a sample comes to nothing, so the density of its direction is zero too.
    #[inline(always)]
    fn sum(a: Self, b: Self) -> Self {
        let f = a.f + b.f;
        let (to_light, to_camera) = (a.to_light.0 + b.to_light.0, a.to_camera.0 + b.to_camera.0);
        Self { f, to_light: PdfSolidAngle(to_light), to_camera: PdfSolidAngle(to_camera) }.only(!f.is_black())
    }

    /// `yes` where the condition holds, `no` elsewhere.
    #[inline(always)]
    fn select(which: L::M, yes: Self, no: Self) -> Self {
        Self {
            f: Rgb::select(which, yes.f, no.f),
            to_light: PdfSolidAngle(which.select(yes.to_light.0, no.to_light.0)),
            to_camera: PdfSolidAngle(which.select(yes.to_camera.0, no.to_camera.0)),
        }
    }

    /// Where a sample of this value stands for something: unless no light passes or the direction has no density
    /// (rounding at the edge of a lobe).
    #[inline(always)]
    pub fn is_sampled(&self, transport: Transport) -> L::M {
        let (forward, _) = self.forward_reverse(transport);
        !self.f.is_black() & forward.0.lanes().splat(0.0).lt(forward.0)
    }

    /// The coefficients of a delta that passes the radiance `value`, is chosen with the given probability from either
    /// end, and has |dω_light/dω_camera| = `jacobian`.
    #[inline(always)]
    fn delta(value: Rgb<L::V>, cos_light: L::F, p_camera: L::F, p_light: L::F, jacobian: L::F) -> Self {
        let scatter = Self {
            f: Rgb::of(value.channels() / cos_light.abs()),
            to_light: PdfSolidAngle(p_camera),
            to_camera: PdfSolidAngle(p_light * jacobian),
        };
        scatter.only(!is_grazing(cos_light))
    }
}

/// The component of a BSDF that a path uses at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// The sum of all smooth components, with their selection probabilities.
    Continuous,
    /// The delta component of this index.
    Delta(u8),
}

/// What a vertex does to light, as path classes name it (Heckbert 1990).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScatterEvent {
    /// Diffuse: the dominant lobe is Lambertian.
    Diffuse,
    /// Glossy: the dominant lobe is a rough microfacet lobe, with what leaves it after several facets.
    Glossy,
    /// Specular: a delta component.
    Specular,
}

/// The value of a BSDF for one pair of directions, with the densities of sampling each from the other.
///
/// For [`Lobe::Continuous`] the densities include the probability of choosing the continuous part and of each lobe
/// within it. For [`Lobe::Delta`] all three are coefficients of one delta with respect to solid angle on the light
/// side: `f` is reflectance/|cos θ_light| (times (η_camera/η_light)² for refraction), `to_light` is the lobe's
/// probability, and `to_camera` is its probability from the light side times |dω_light/dω_camera|, which for refraction
/// is η_camera² |cos θ_camera| / (η_light² |cos θ_light|) and 1 for a mirror.
#[derive(Clone, Copy, Debug)]
pub struct Scatter<L: Lanes = One> {
    /// The BSDF in the radiance convention, 1/sr; no cosine.
    pub f: Rgb<L::V>,
    /// The density of sampling the light direction, given the camera direction ([`Transport::Radiance`]).
    pub to_light: PdfSolidAngle<L::F>,
    /// The density of sampling the camera direction, given the light direction ([`Transport::Importance`]).
    pub to_camera: PdfSolidAngle<L::F>,
}

impl PartialEq for Scatter {
    fn eq(&self, other: &Self) -> bool {
        (self.f, self.to_light, self.to_camera) == (other.f, other.to_light, other.to_camera)
    }
}

impl Scatter {
    /// No light passes, and neither direction is ever sampled from the other.
    pub const ZERO: Self = Self { f: Rgb::ZERO, to_light: PdfSolidAngle::ZERO, to_camera: PdfSolidAngle::ZERO };
}

impl ScatterEvent {
    /// The event of the larger of two lobes.
    #[inline]
    fn dominant(diffuse: &Scatter, specular: &Scatter) -> Self {
        if diffuse.f.max_element() > specular.f.max_element() { Self::Diffuse } else { Self::Glossy }
    }
}

/// A sampled direction with the lobe it came from and the BSDF there.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The sampled unit direction, in the space of the known one.
    pub direction: Vec3,
    /// The lobe that it belongs to.
    pub lobe: Lobe,
    /// The same as [`Bsdf::eval`] returns for this lobe and the two directions.
    pub scatter: Scatter,
}

impl BsdfSample {
    /// The sample, if it is one: see [`Scatter::is_sampled`].
    #[inline(always)]
    fn checked(direction: Vec3, lobe: Lobe, scatter: Scatter, transport: Transport) -> Option<Self> {
        scatter.is_sampled(transport).then_some(Self { direction, lobe, scatter })
    }
}

/// Directions with |cos θ| below this are in the surface's plane to the accuracy of a frame in f32. Deltas and
/// microfacet lobes, whose value divides by the cosine, do not scatter them.
const GRAZING: f32 = 1e-6;

/// Where a direction with this cosine is in the surface's plane: see [`GRAZING`].
#[inline(always)]
fn is_grazing<F: Float>(cos: F) -> <F::Lanes as Lanes>::M {
    cos.abs().lt(cos.lanes().splat(GRAZING))
}

/// The mirror direction of `w` at the surface.
#[inline(always)]
fn mirrored<V: Vector>(w: V) -> V {
    let [x, y, z] = w.coordinates();
    V::new(-x, -y, z)
}

/// A cosine-distributed direction on the side of `known`.
#[inline(always)]
fn cosine_on_side<V: Vector>(known: V, u: [V::F; 2]) -> V {
    let [x, y, z] = warp::cosine_hemisphere(u).coordinates();
    V::new(x, y, z.copysign(known.coordinates()[2]))
}

/// A BSDF with its parameters resolved at one point.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf {
    /// Lambert.
    Diffuse(Diffuse),
    /// An opaque dielectric or metal, rough or smooth.
    MetallicRoughness(MetallicRoughness),
    /// The boundary of a refracting volume, rough or smooth.
    Dielectric(Dielectric),
    /// A thin-walled transmitting surface.
    Thin(ThinDielectric),
    /// A surface in layers.
    Layered(Layered),
}

macro_rules! dispatch {
    ($bsdf:expr, $b:ident => $call:expr) => {
        match $bsdf {
            Bsdf::Diffuse($b) => $call,
            Bsdf::MetallicRoughness($b) => $call,
            Bsdf::Dielectric($b) => $call,
            Bsdf::Thin($b) => $call,
            Bsdf::Layered($b) => $call,
        }
    };
}

impl Bsdf {
    /// f and both densities of one lobe, for the directions towards the camera and towards the light.
    ///
    /// With [`Lobe::Delta`] the two directions are taken to satisfy the delta (mirror direction, Snell's law).
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        dispatch!(self, b => b.eval(lobe, to_camera, to_light))
    }

    /// Samples the direction across from `known`, with one number for the lobe (`u.z`) and two for the direction.
    /// `None` where nothing is scattered or the sampled direction is invalid.
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        dispatch!(self, b => b.sample(known, transport, u))
    }

    /// [`Self::eval`] for unit world directions at a surface with the unit normal `n`.
    #[inline(always)]
    pub fn eval_around(&self, n: Vec3, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        match self {
            // Lambert's law, the common one, is in line, and needs the cosines alone.
            Self::Diffuse(b) if lobe == Lobe::Continuous => b.between(n.dot(to_camera), n.dot(to_light)),
            _ => self.eval_in_frame(n, lobe, to_camera, to_light),
        }
    }

    #[inline(never)]
    fn eval_in_frame(&self, n: Vec3, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let frame = Frame::around(n);
        self.eval(lobe, frame.to_local(to_camera), frame.to_local(to_light))
    }

    /// [`Self::sample_by`] for a unit world direction at a surface with the unit normal `n`; the sampled one is in
    /// world space too.
    #[inline(always)]
    pub fn sample_around(
        &self,
        n: Vec3,
        directions: Directions,
        known: Vec3,
        transport: Transport,
        u: Vec3,
    ) -> Option<BsdfSample> {
        match (self, directions) {
            (Self::Diffuse(b), Directions::Bsdf) => {
                let (direction, scatter) = b.sample_around(n, known, transport, [u.x, u.y]);
                BsdfSample::checked(direction, Lobe::Continuous, scatter, transport)
            }
            _ => self.sample_in_frame(n, directions, known, transport, u),
        }
    }

    #[inline(never)]
    fn sample_in_frame(
        &self,
        n: Vec3,
        directions: Directions,
        known: Vec3,
        transport: Transport,
        u: Vec3,
    ) -> Option<BsdfSample> {
        let frame = Frame::around(n);
        let sample = self.sample_by(directions, frame.to_local(known), transport, u)?;
        Some(BsdfSample { direction: frame.to_world(sample.direction).normalize(), ..sample })
    }

    /// The surface's colour, in [0, 1]: the albedo of what is diffuse, the tint of what transmits, the reflectance of a
    /// metal seen head-on. What denoisers call albedo; no light transport depends on it.
    pub fn color(&self) -> Rgb {
        match self {
            Self::Diffuse(b) => b.albedo,
            Self::MetallicRoughness(b) => b.base_color,
            Self::Dielectric(b) => b.color,
            Self::Thin(b) => b.color,
            Self::Layered(b) => b.color(),
        }
    }

    /// Whether there is a continuous part that a connection could use.
    #[inline(always)]
    pub fn has_continuous(&self) -> bool {
        dispatch!(self, b => b.has_continuous())
    }

    /// How many delta components there are: their lobes are `Delta(0)` … `Delta(n − 1)`.
    #[inline]
    pub fn delta_count(&self) -> u8 {
        dispatch!(self, b => b.delta_count())
    }

    /// The probability, in [0, 1], with which [`Self::sample`] takes the continuous part from `known`; deltas have the
    /// rest.
    #[inline]
    pub fn continuous_probability(&self, known: Vec3) -> f32 {
        dispatch!(self, b => b.continuous_probability(known))
    }

    /// Whether the continuous part may scatter to the other side of the surface.
    #[inline]
    pub fn continuous_transmits(&self) -> bool {
        match self {
            Self::Diffuse(_) | Self::MetallicRoughness(_) => false,
            Self::Dielectric(d) => d.continuous_transmits(),
            Self::Thin(t) => t.continuous_transmits(),
            Self::Layered(l) => l.continuous_transmits(),
        }
    }

    /// Whether the surface may scatter to its other side.
    #[inline]
    pub fn transmits(&self) -> bool {
        matches!(self, Self::Dielectric(_) | Self::Thin(_)) || self.continuous_transmits()
    }

    /// The path-class event: a deterministic function of the lobe and the two directions.
    #[inline]
    pub fn event(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        match lobe {
            Lobe::Delta(_) => ScatterEvent::Specular,
            Lobe::Continuous => dispatch!(self, b => b.continuous_event(to_camera, to_light)),
        }
    }

    /// η_light / η_camera: 1 unless the directions lie on the two sides of a refracting boundary.
    #[inline(always)]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        match self {
            Self::Dielectric(d) => d.relative_ior(to_camera, to_light),
            Self::Layered(l) => l.relative_ior(to_camera, to_light),
            _ => 1.0,
        }
    }

    /// Whether a volume lies behind the surface.
    #[inline(always)]
    pub fn bounds_volume(&self) -> bool {
        match self {
            Self::Dielectric(_) => true,
            Self::Layered(l) => l.bounds_volume(),
            _ => false,
        }
    }

    /// Makes `ior` the index of refraction of the volume behind the surface relative to that in front of it; without a
    /// volume nothing.
    pub fn set_volume_ior(&mut self, ior: f32) {
        match self {
            Self::Dielectric(d) => d.ior = ior,
            Self::Layered(l) => *l = l.with_volume_ior(ior),
            _ => {}
        }
    }
}
