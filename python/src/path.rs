//! A path by its definition, for as long as Python wants it.

use std::sync::Arc;

use glam::DVec3;
use pathspace::{
    integrator::Integrator,
    path::{self, Strategy, Technique, Vertex},
    scene::{
        Scene,
        bsdf::Directions,
        camera::Raster,
        geometry::PrimitiveId,
        point::{Place, Point},
        wavelength::Wavelength,
    },
    trace::{self, Share},
};
use pyo3::{exceptions::PyIndexError, prelude::*};

use crate::{cli::shared::exit::Failure, errors::exception, settings::Settings};

/// A path p̄ = p_0 … p_n of a scene, camera first.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Path {
    pub scene: Arc<Scene>,
    pub vertices: Vec<Vertex>,
    pub visibility: Vec<f64>,
    pub merged: Option<(usize, Point)>,
    pub raster: Raster,
    /// That of the sample that has found it, where the scene disperses.
    pub wavelength: Option<Wavelength>,
    pub found: Option<Found>,
}

/// How a render found a path.
pub struct Found {
    pub technique: Technique,
    /// w F/(n p) over roulette's survival probability, of the fast form.
    pub value: [f32; 3],
    pub survival: f32,
    /// The table and the rule of that pass.
    pub integrator: Arc<Integrator>,
}

/// A technique as Python writes it: its kind, s and t.
type Written = (String, u32, u32);

/// (kind, s, t, n, p, radius, v, w).
type Row = (&'static str, u32, u32, f64, f64, Option<f32>, f64, f64);

/// (kind, s, t), the value of the fast form, and the survival probability.
type Finding = ((&'static str, u32, u32), [f32; 3], f32);

/// Kind of event, material, place, N_g, N_s, whether the place is a direction, and α.
type Described = (String, Option<String>, [f64; 3], [f64; 3], [f64; 3], bool, f32);

fn written(technique: Technique) -> (&'static str, u32, u32) {
    match technique {
        Technique::Bidirectional(Strategy { s, t }) => ("strategy", s, t),
        Technique::Merged(Strategy { s, t }) => ("merge", s, t),
        Technique::Area => ("area", 0, 0),
    }
}

impl Path {
    fn defined(&self) -> path::Path<'_> {
        let path = path::Path::new(&self.scene, self.vertices.clone()).with_visibility(self.visibility.clone());
        let path = path.arriving_at(self.raster).at_wavelength(self.wavelength);
        match self.merged {
            Some((i, q)) => path.merged_at(i, q),
            None => path,
        }
    }

    /// The technique that Python has written, where a path of this length has it.
    fn technique(&self, py: Python<'_>, (kind, s, t): &Written) -> PyResult<Technique> {
        let (s, t, vertices) = (*s, *t, self.vertices.len() as u32);
        let strategy = Strategy { s, t };
        let refuse = |what: String| Err(exception(py, &Failure::usage(what)));
        match kind.as_str() {
            "area" => Ok(Technique::Area),
            _ if s.checked_add(t) != Some(vertices) => {
                refuse(format!("a path of {vertices} vertices has no technique with s = {s} and t = {t}"))
            }
            "strategy" => Ok(Technique::Bidirectional(strategy)),
            "merge" if s >= 1 && t >= 2 => Ok(Technique::Merged(strategy)),
            _ => refuse("a path merges at a vertex between its ends".to_owned()),
        }
    }

    fn edge(&self, i: usize) -> PyResult<usize> {
        let edges = self.visibility.len();
        if i < edges { Ok(i) } else { Err(PyIndexError::new_err(format!("the path has the edges 0 to {}", edges - 1))) }
    }

    fn described(&self, event: String, point: &Point) -> Described {
        let is_surface = point.primitive != PrimitiveId::NONE;
        let material = is_surface.then(|| self.scene.material(point.material).name.clone());
        let place = match point.place {
            Place::Film => point.normal.as_dvec3(),
            Place::Infinite => point.position.as_dvec3(),
            Place::Surface | Place::Degenerate => self.scene.centre + point.position.as_dvec3(),
        };
        let is_direction = matches!(point.place, Place::Film | Place::Infinite);
        let [normal, shading] = [point.normal, point.shading_normal].map(|n| n.as_dvec3().to_array());
        (event, material, place.to_array(), normal, shading, is_direction, point.alpha)
    }

    fn shares(&self, integrator: &Integrator) -> Vec<Share> {
        trace::shares(&self.defined(), self.raster, integrator)
    }
}

fn array(v: DVec3) -> [f64; 3] {
    v.to_array()
}

#[pymethods]
impl Path {
    #[getter]
    fn edges(&self) -> usize {
        self.visibility.len()
    }

    #[getter]
    #[pyo3(name = "class_")]
    fn class(&self) -> String {
        self.defined().class().to_string()
    }

    #[getter]
    fn raster(&self) -> [f32; 2] {
        self.raster.0.to_array()
    }

    /// In nm.
    #[getter]
    fn wavelength(&self) -> Option<f32> {
        self.wavelength.map(Wavelength::nanometres)
    }

    #[getter]
    fn visibility(&self) -> Vec<f64> {
        self.visibility.clone()
    }

    fn vertices(&self) -> Vec<Described> {
        let class = self.defined().class().to_string();
        let letters = class.chars().map(String::from);
        letters.zip(&self.vertices).map(|(event, vertex)| self.described(event, &vertex.point)).collect()
    }

    /// The vertex at which two subpaths have merged, and the place where the light's ended.
    fn merged(&self) -> Option<(usize, [f64; 3])> {
        self.merged.as_ref().map(|(i, q)| (*i, array(self.scene.centre + q.position.as_dvec3())))
    }

    fn throughput(&self) -> [f64; 3] {
        array(self.defined().throughput())
    }

    fn geometry_term(&self, i: usize) -> PyResult<f64> {
        Ok(self.defined().geometry_term(self.edge(i)?))
    }

    fn contribution(&self) -> [f64; 3] {
        array(self.defined().contribution())
    }

    /// The density of a technique, of walks by the rule of the settings or by the BSDF.
    #[pyo3(signature = (technique, settings=None))]
    fn pdf(&self, py: Python<'_>, technique: Written, settings: Option<&Settings>) -> PyResult<f64> {
        let path = self.defined();
        let directions = settings.map_or(Directions::Bsdf, |x| x.integrator.techniques().directions());
        Ok(match self.technique(py, &technique)? {
            Technique::Bidirectional(strategy) => path.pdf_by(directions, strategy),
            Technique::Merged(strategy) => path.density_of_meeting(strategy),
            Technique::Area => path.pdf_area(),
        })
    }

    /// All techniques of this length by the table of the settings, or of the render that has found the path.
    #[pyo3(signature = (settings=None))]
    fn techniques(&self, py: Python<'_>, settings: Option<&Settings>) -> PyResult<Vec<Row>> {
        let integrator = match (settings, &self.found) {
            (Some(settings), _) => &settings.integrator,
            (None, Some(found)) => &found.integrator,
            (None, None) => {
                return Err(exception(py, &Failure::usage("no render has found this path: name an integrator")));
            }
        };
        let row = |share: Share| {
            let (kind, s, t) = written(share.technique);
            let Share { count, pdf, radius, variance_factor, weight, .. } = share;
            (kind, s, t, count, pdf, radius, variance_factor, weight)
        };
        Ok(py.detach(|| self.shares(integrator)).into_iter().map(row).collect())
    }

    /// What found the path.
    #[getter]
    fn found(&self) -> Option<Finding> {
        self.found.as_ref().map(|found| (written(found.technique), found.value, found.survival))
    }
}
