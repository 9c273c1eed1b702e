//! GLB files out of meshes, spheres, materials and a camera.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::{
    images::png,
    shapes::{self, Mesh, V3},
};

/// What a surface is made of.
#[derive(Clone, Copy)]
pub enum Surface {
    /// Lambert.
    Diffuse([f64; 3]),
    /// A black Lambert surface whose front emits this radiance.
    Emitter([f64; 3]),
    /// A gray Lambert surface whose front emits as well.
    Glowing { albedo: f64, radiance: f64 },
    /// A smooth metal.
    Mirror(f64),
    /// The boundary of a clear volume with this index of refraction.
    Glass(f64),
    /// The same, with the extension's `dispersion`.
    Flint { ior: f64, dispersion: f64 },
    /// Glass, ground rough.
    Frosted { ior: f64, roughness: f64 },
    /// Plastic (`metallic` 0) or metal (1).
    Glossy { color: [f64; 3], metallic: f64, roughness: f64 },
    /// Plastic with textures: colour, and roughness (G) with a normal map.
    Papered { color: usize, relief: Option<(usize, usize)> },
    /// A black Lambert surface whose front emits the texture's colour times this radiance.
    Screen { image: usize, radiance: f64 },
}

/// A light without a surface.
#[derive(Clone, Copy)]
pub enum Punctual {
    Point,
    /// With its inner and outer half angle.
    Spot(f64, f64),
    /// With the irradiance as its intensity.
    Sun,
}

/// A perspective camera with y up.
#[derive(Clone, Copy)]
pub struct Camera {
    pub position: V3,
    pub target: V3,
    pub yfov: f64,
    pub aspect: f64,
}

/// A file in the making.
pub struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    names: Vec<String>,
    nodes: Vec<Value>,
    images: Vec<Value>,
    lights: Vec<Value>,
    extensions: BTreeSet<String>,
    camera: Value,
}

impl Builder {
    pub fn new(camera: Camera) -> Self {
        let matrix = looking(camera.position, camera.target);
        Self {
            bytes: Vec::new(),
            views: Vec::new(),
            accessors: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
            names: Vec::new(),
            nodes: vec![json!({ "name": "camera", "camera": 0, "matrix": matrix })],
            images: Vec::new(),
            lights: Vec::new(),
            extensions: BTreeSet::new(),
            camera: json!({ "type": "perspective", "perspective": {
                "yfov": rounded(camera.yfov), "aspectRatio": rounded(camera.aspect), "znear": 0.01 } }),
        }
    }

    /// Adds a mesh. Surfaces of the same name are the same material.
    pub fn mesh(&mut self, name: &str, material: &str, surface: Surface, mesh: &Mesh) {
        self.parts(name, &[(material, surface, mesh)]);
    }

    /// Adds a mesh of several parts.
    pub fn parts(&mut self, name: &str, parts: &[(&str, Surface, &Mesh)]) {
        let mesh = self.model(name, parts);
        self.nodes.push(json!({ "name": name, "mesh": mesh }));
    }

    /// Makes a mesh of several materials without placing it.
    pub fn model(&mut self, name: &str, parts: &[(&str, Surface, &Mesh)]) -> usize {
        let primitives: Vec<_> =
            parts.iter().map(|(material, surface, mesh)| self.part(material, *surface, mesh)).collect();
        self.meshes.push(json!({ "name": name, "primitives": primitives }));
        self.meshes.len() - 1
    }

    /// Places a mesh.
    pub fn place(&mut self, name: &str, mesh: usize, translation: V3, scale: V3) {
        self.nodes.push(json!({ "name": name, "mesh": mesh, "translation": translation, "scale": scale }));
    }

    /// Places a mesh at each of these points (`EXT_mesh_gpu_instancing`).
    pub fn place_many(&mut self, name: &str, mesh: usize, translations: &[V3]) {
        let translations = self.vectors(translations, false);
        self.extensions.insert("EXT_mesh_gpu_instancing".to_owned());
        self.nodes.push(json!({ "name": name, "mesh": mesh, "extensions": {
            "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translations } } } }));
    }

    /// Adds a light of `intensity` candela (or lux), which points from `position` to `target`.
    pub fn light(&mut self, name: &str, kind: Punctual, intensity: [f64; 3], position: V3, target: V3) {
        let top = intensity.into_iter().fold(0.0, f64::max);
        let mut light = json!({ "name": name, "color": intensity.map(|x| rounded(x / top)), "intensity": top });
        light["type"] = match kind {
            Punctual::Point => "point".into(),
            Punctual::Sun => "directional".into(),
            Punctual::Spot(inner, outer) => {
                light["spot"] = json!({ "innerConeAngle": rounded(inner), "outerConeAngle": rounded(outer) });
                "spot".into()
            }
        };
        self.extensions.insert("KHR_lights_punctual".to_owned());
        self.nodes.push(json!({ "name": name, "matrix": looking(position, target),
            "extensions": { "KHR_lights_punctual": { "light": self.lights.len() } } }));
        self.lights.push(light);
    }

    /// Adds an image, `side` pixels square, as a texture that repeats.
    pub fn texture(&mut self, name: &str, side: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> usize {
        let bytes = png(side, pixel);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.images.push(json!({ "name": name, "mimeType": "image/png", "bufferView": self.views.len() }));
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend(bytes);
        self.images.len() - 1
    }

    fn part(&mut self, material: &str, surface: Surface, mesh: &Mesh) -> Value {
        let material = self.material(material, surface);
        let mut attributes = json!({ "POSITION": self.vectors(&mesh.positions, true) });
        if let Some(normals) = &mesh.normals {
            attributes["NORMAL"] = self.vectors(normals, false).into();
        }
        if let Some(uvs) = &mesh.uvs {
            let bytes: Vec<u8> = uvs.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()).collect();
            let description = json!({ "componentType": 5126, "type": "VEC2", "count": uvs.len() });
            attributes["TEXCOORD_0"] = self.accessor(&bytes, 34962, description).into();
        }
        let indices: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| (*i as u16).to_le_bytes()).collect();
        let indices = self.accessor(
            &indices,
            34963,
            json!({
            "componentType": 5123, "type": "SCALAR", "count": 3 * mesh.triangles.len() }),
        );
        json!({ "attributes": attributes, "indices": indices, "material": material })
    }

    /// Adds an analytic sphere.
    pub fn sphere(&mut self, name: &str, material: &str, surface: Surface, center: V3, radius: f64) {
        let material = self.material(material, surface);
        self.extensions.insert("PATHSPACE_sphere".to_owned());
        self.nodes.push(json!({ "name": name, "translation": center,
            "extensions": { "PATHSPACE_sphere": { "radius": radius, "material": material } } }));
    }

    fn material(&mut self, name: &str, surface: Surface) -> usize {
        if let Some(i) = self.names.iter().position(|other| other == name) {
            return i;
        }
        let mut m = json!({ "name": name });
        let extensions = describe(surface, &mut m);
        if let Some(extensions) = extensions.as_object().filter(|extensions| !extensions.is_empty()) {
            self.extensions.extend(extensions.keys().cloned());
            m["extensions"] = json!(extensions);
        }
        // Other viewers cull one-sided surfaces; here the flag would only make emitters shine on both sides.
        let shines = matches!(surface, Surface::Emitter(_) | Surface::Glowing { .. } | Surface::Screen { .. });
        let refracts = matches!(surface, Surface::Glass(_) | Surface::Frosted { .. });
        if !shines && !refracts {
            m["doubleSided"] = true.into();
        }
        self.names.push(name.to_owned());
        self.materials.push(m);
        self.materials.len() - 1
    }

    fn vectors(&mut self, vectors: &[V3], bounds: bool) -> usize {
        let vectors: Vec<[f32; 3]> = vectors.iter().map(|v| v.map(|x| x as f32)).collect();
        let bytes: Vec<u8> = vectors.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let mut description = json!({ "componentType": 5126, "type": "VEC3", "count": vectors.len() });
        if bounds {
            let fold =
                |start: f32, f: fn(f32, f32) -> f32| [0, 1, 2].map(|i| vectors.iter().map(|v| v[i]).fold(start, f));
            description["min"] = json!(fold(f32::INFINITY, f32::min));
            description["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.accessor(&bytes, 34962, description)
    }

    fn accessor(&mut self, bytes: &[u8], target: u32, mut description: Value) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        description["bufferView"] = self.views.len().into();
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(), "target": target }));
        self.bytes.extend_from_slice(bytes);
        self.accessors.push(description);
        self.accessors.len() - 1
    }

    /// The bytes of the file.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let mut document = json!({
            "asset": { "version": "2.0", "generator": "pathspace make_scenes" },
            "scene": 0, "scenes": [{ "nodes": nodes }],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials, "cameras": [self.camera],
            "accessors": self.accessors, "bufferViews": self.views, "buffers": [{ "byteLength": self.bytes.len() }],
            "extensionsUsed": self.extensions,
        });
        if !self.images.is_empty() {
            document["textures"] = (0..self.images.len()).map(|source| json!({ "source": source })).collect();
            document["images"] = self.images.into();
        }
        if !self.lights.is_empty() {
            document["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut out = b"glTF".to_vec();
        let words = |n: usize| (n as u32).to_le_bytes();
        out.extend(words(2));
        out.extend(words(28 + json.len() + self.bytes.len()));
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            out.extend(words(chunk.len()));
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }
}

/// Fills a material in as `surface` is; returns its extensions.
fn describe(surface: Surface, m: &mut Value) -> Value {
    let lambert = json!({ "specularFactor": 0.0 });
    let (color, metallic, roughness, extensions) = match surface {
        Surface::Diffuse(color) => (color, 0.0, 1.0, json!({ "KHR_materials_specular": lambert })),
        Surface::Emitter(radiance) => {
            let (factor, strength) = emission(radiance);
            m["emissiveFactor"] = json!(factor);
            let extensions = json!({
                "KHR_materials_specular": lambert, "KHR_materials_emissive_strength": strength });
            ([0.0; 3], 0.0, 1.0, extensions)
        }
        Surface::Glowing { albedo, radiance } => {
            m["emissiveFactor"] = json!([radiance, radiance, radiance]);
            ([albedo; 3], 0.0, 1.0, json!({ "KHR_materials_specular": lambert }))
        }
        Surface::Mirror(reflectance) => ([reflectance; 3], 1.0, 0.0, json!({})),
        Surface::Glass(ior) => ([1.0; 3], 0.0, 0.0, glass(ior)),
        Surface::Flint { ior, dispersion } => {
            let mut extensions = glass(ior);
            extensions["KHR_materials_dispersion"] = json!({ "dispersion": dispersion });
            ([1.0; 3], 0.0, 0.0, extensions)
        }
        Surface::Frosted { ior, roughness } => ([1.0; 3], 0.0, roughness, glass(ior)),
        Surface::Glossy { color, metallic, roughness } => (color, metallic, roughness, json!({})),
        Surface::Papered { relief, .. } => {
            if let Some((_, normal)) = relief {
                m["normalTexture"] = json!({ "index": normal });
            }
            ([1.0; 3], 0.0, if relief.is_some() { 1.0 } else { 0.7 }, json!({}))
        }
        Surface::Screen { image, radiance } => {
            m["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            m["emissiveTexture"] = json!({ "index": image });
            let strength = json!({ "emissiveStrength": radiance });
            let extensions = json!({
                "KHR_materials_specular": lambert, "KHR_materials_emissive_strength": strength });
            ([0.0; 3], 0.0, 1.0, extensions)
        }
    };
    m["pbrMetallicRoughness"] = json!({
        "baseColorFactor": [color[0], color[1], color[2], 1.0],
        "metallicFactor": metallic, "roughnessFactor": roughness });
    if let Surface::Papered { color, relief } = surface {
        m["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": color });
        if let Some((roughness, _)) = relief {
            m["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({ "index": roughness });
        }
    }
    extensions
}

/// The emissive factor, at most 1, and the `KHR_materials_emissive_strength` that make up this radiance.
fn emission(radiance: [f64; 3]) -> ([f64; 3], Value) {
    let top = radiance.into_iter().fold(0.0, f64::max);
    (radiance.map(|x| rounded(x / top)), json!({ "emissiveStrength": top }))
}

fn glass(ior: f64) -> Value {
    json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_ior": { "ior": ior },
        "KHR_materials_volume": { "thicknessFactor": 1.0 } })
}

/// The matrix of a camera or light at `position` that looks at `target`: along its −z.
fn looking(position: V3, target: V3) -> Value {
    let z = shapes::unit(shapes::sub(position, target));
    let up = if z[1].abs() < 0.999 { [0., 1., 0.] } else { [0., 0., 1.] };
    let x = shapes::unit(shapes::cross(up, z));
    let y = shapes::cross(z, x);
    let [p, x, y, z] = [position, x, y, z].map(|v| v.map(rounded));
    json!([x[0], x[1], x[2], 0.0, y[0], y[1], y[2], 0.0, z[0], z[1], z[2], 0.0, p[0], p[1], p[2], 1.0])
}

/// Six decimals: what follows differs between mathematics libraries.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}
