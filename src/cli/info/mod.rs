//! `pathspace info`: what a scene file holds.

mod json;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use glam::{DVec3, Vec3};
use pathspace::{
    io::{self, Loaded, NamedAnimation, PunctualLight, Summary, ThinLens, View},
    scene::{
        Scene,
        bsdf::{Bsdf, Metal},
        material::{Boundary, Material, MaterialId},
    },
};

use crate::cli::shared::{
    args::LoadArgs,
    environment::NEUTRAL,
    exit::Failure,
    number::{short, short_vec},
    terminal,
};

/// The options of `pathspace info`.
#[derive(Debug, clap::Args)]
pub struct InfoArgs {
    /// The scene, glTF 2.0 (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    file: PathBuf,

    /// Scene of a file with several, by name or index [default: the file's default, else the first]
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    scene: Option<String>,

    #[command(flatten)]
    load: LoadArgs,

    /// Write JSON for programs: lengths in metres, angles in radians
    #[arg(long)]
    json: bool,
}

pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let loaded = io::load_with(&args.file, &args.load.options(args.scene.as_deref()))?;
    if args.json {
        terminal::answer(format_args!("{:#}", json::describe(&loaded)));
        return Ok(());
    }
    terminal::answer(describe(&loaded));
    for warning in &loaded.warnings {
        terminal::answer(format_args!("warning    {warning}"));
    }
    Ok(())
}

/// One line for each kind of thing, one for each camera.
pub fn describe(loaded: &Loaded) -> String {
    let geometry = &loaded.geometry;
    let mut lines = vec![
        format!("hash       {}", loaded.hash),
        format!("scenes     {}", scenes(&loaded.summary)),
        format!("geometry   {} triangles, {} spheres", geometry.triangle_count(), geometry.sphere_count()),
    ];
    lines.extend(variants(&loaded.summary));
    lines.extend(animations(&loaded.summary));
    if geometry.instance_count() > 0 {
        let (instances, meshes) = (geometry.instance_count(), geometry.mesh_count());
        lines.push(format!("instances  {instances} of {meshes} shared meshes, whose triangles are counted in each"));
    }
    let centre = loaded.centre;
    // Places in the file's coordinates; far from its origin six digits say nothing, and millimetres do.
    let at = |p: Vec3| match centre + p.as_dvec3() {
        _ if centre == DVec3::ZERO => short_vec(p),
        far => format!("[{:.3}, {:.3}, {:.3}]", far.x, far.y, far.z),
    };
    if centre != DVec3::ZERO {
        lines.push(format!("centre     {centre}, metres: far from the origin, computed from here"));
    }
    if let Some(bounds) = geometry.bounds() {
        lines.push(format!("bounds     {} to {}, metres", at(bounds.min), at(bounds.max)));
    }
    lines.push(format!("materials  {}", materials(&loaded.materials)));
    lines.push(format!("lights     {}", lights(loaded)));
    for (index, camera) in loaded.cameras.iter().enumerate() {
        let aspect = camera.aspect.map(|aspect| format!(", aspect {aspect:.3}")).unwrap_or_default();
        let view = view(camera.view);
        lines.push(format!("camera     {index} '{}': at {}, {view}{aspect}", camera.name, at(camera.position)));
    }
    if loaded.cameras.is_empty() {
        lines.push("camera     none; 'render' frames the whole scene".to_owned());
    }
    lines.join("\n")
}

/// `1,234 triangles, 2 spheres, 5 lights`, with the triangles of instances counted in each.
pub fn counts(scene: &Scene) -> String {
    let geometry = scene.geometry();
    let count = |n: u64, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    format!(
        "{}, {}, {} (each emissive triangle is one)",
        count(geometry.triangle_count(), "triangle"),
        count(geometry.sphere_count().into(), "sphere"),
        count(scene.lights().all().len() as u64, "light")
    )
}

/// `2: 0 'day' (shown), 1 'night'`.
fn scenes(summary: &Summary) -> String {
    let one = |(index, name): (usize, &Option<String>)| {
        let name = name.as_ref().map(|name| format!(" '{name}'")).unwrap_or_default();
        let shown = if summary.scene == Some(index) { " (shown)" } else { "" };
        format!("{index}{name}{shown}")
    };
    match summary.scenes.len() {
        0 => "none: all nodes are shown".to_owned(),
        count => format!("{count}: {}", summary.scenes.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")),
    }
}

/// `variants   2: 0 'beach' (shown), 1 'street'`, for a file that has any.
fn variants(summary: &Summary) -> Option<String> {
    let one = |(index, name): (usize, &String)| {
        format!("{index} '{name}'{}", if summary.variant == Some(index) { " (shown)" } else { "" })
    };
    let list = || summary.variants.iter().enumerate().map(one).collect::<Vec<_>>().join(", ");
    (!summary.variants.is_empty()).then(|| format!("variants   {}: {}", summary.variants.len(), list()))
}

/// `animations 2: 0 'Walk' (0.708 s, shown at 0.25 s), 1 'Run' (1.16 s)`, for a file that has any.
fn animations(summary: &Summary) -> Option<String> {
    let one = |(index, animation): (usize, &NamedAnimation)| {
        let name = animation.name.as_ref().map(|name| format!(" '{name}'")).unwrap_or_default();
        let seconds = animation.seconds.map_or_else(|| "of unknown length".to_owned(), |s| format!("{} s", short(s)));
        let at = summary.at.filter(|_| animation.shown).map(|at| format!(", shown at {} s", short(at)));
        format!("{index}{name} ({seconds}{})", at.unwrap_or_default())
    };
    let list = || summary.animations.iter().enumerate().map(one).collect::<Vec<_>>().join(", ");
    (!summary.animations.is_empty()).then(|| format!("animations {}: {}", summary.animations.len(), list()))
}

fn view(view: View) -> String {
    match view {
        View::Perspective { yfov, lens } => {
            let lens = lens.map(|ThinLens { aperture, focus, blades }| {
                let blades = blades.map(|blades| format!(", {} blades", blades.count())).unwrap_or_default();
                format!(", lens {} m wide{blades}, sharp at {} m", short(aperture), short(focus))
            });
            format!("yfov {:.1}°{}", yfov.to_degrees(), lens.unwrap_or_default())
        }
        View::Orthographic { height } => format!("orthographic, {} m high", short(height)),
    }
}

/// `5: 3 diffuse, 1 metallic-roughness, 1 glass; 1 of them emits`.
fn materials(materials: &[Material]) -> String {
    let mut kinds = BTreeMap::new();
    for material in materials {
        *kinds.entry(kind(material)).or_insert(0) += 1;
    }
    if kinds.is_empty() {
        return "none".to_owned();
    }
    let kinds = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", ");
    let emitters = materials.iter().filter(|material| material.emits()).count();
    let dispersing = materials.iter().filter(|material| material.dispersion > 0.0).count();
    let dispersing = if dispersing > 0 { format!("; dispersing: {dispersing}") } else { String::new() };
    let metals: BTreeSet<_> = materials.iter().filter_map(Material::measured_metal).map(Metal::symbol).collect();
    let metals: Vec<_> = metals.into_iter().collect();
    let metals = if metals.is_empty() { String::new() } else { format!("; measured: {}", metals.join(", ")) };
    format!("{}: {kinds}; emitting: {emitters}{dispersing}{metals}", materials.len())
}

/// `12 emissive triangles, 1 emissive sphere, 2 points, 1 sun`.
fn lights(loaded: &Loaded) -> String {
    let kinds = light_kinds(loaded);
    let present: Vec<_> =
        kinds.iter().filter(|(count, _)| *count > 0).map(|(count, kind)| format!("{count} {kind}")).collect();
    if present.is_empty() {
        format!("none: 'render' adds an environment of radiance {}", NEUTRAL.r())
    } else {
        present.join(", ")
    }
}

/// How many lights there are of each kind.
pub fn light_kinds(loaded: &Loaded) -> [(usize, &'static str); 7] {
    let geometry = &loaded.geometry;
    let emits = |id: MaterialId| loaded.materials[id.0 as usize].emits();
    let (spheres, triangles): (Vec<_>, Vec<_>) = geometry.with_material(&emits).partition(|&id| geometry.is_sphere(id));
    let punctual = |is: fn(&PunctualLight) -> bool| loaded.lights.iter().filter(|light| is(light)).count();
    [
        (triangles.len(), "emissive triangles"),
        (spheres.len(), "emissive spheres"),
        (punctual(|light| matches!(light, PunctualLight::Point { .. })), "points"),
        (punctual(|light| matches!(light, PunctualLight::Spot { .. })), "spots"),
        (punctual(|light| matches!(light, PunctualLight::Profile { .. })), "light profiles"),
        (punctual(|light| matches!(light, PunctualLight::Directional { .. })), "suns"),
        (usize::from(loaded.environment.is_some()), "environments"),
    ]
}

/// What a material scatters like; one that transmits in places counts as what it is there.
pub fn kind(material: &Material) -> &'static str {
    let boundary = material.maps.as_ref().map(|maps| maps.factors.boundary);
    match (boundary, &material.bsdf) {
        (_, Bsdf::Layered(_)) => "layered",
        (Some(Boundary::Volume), _) | (_, Bsdf::Dielectric(_)) => "dielectric",
        (Some(Boundary::Thin), _) | (_, Bsdf::Thin(_)) => "thin dielectric",
        (_, Bsdf::Diffuse(_)) => "diffuse",
        (_, Bsdf::MetallicRoughness(_)) => "metallic-roughness",
    }
}
