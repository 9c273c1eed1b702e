//! Draco meshes (`KHR_draco_mesh_compression`): the geometry of a primitive, decompressed by draco-core.

use std::collections::{HashMap, HashSet};

use draco_core::{DataType, DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointAttribute, PointIndex};
use gltf_json::{
    Accessor, Index, Root,
    accessor::ComponentType,
    mesh::{Primitive, Semantic},
    validation::Checked,
};
use serde_json::{Map, Value};

use super::{
    accessor::{self, Packed},
    buffer::{Buffers, DECODED},
    error::{Fault, one_line},
    limits::{Limit, Limits},
};

const NAME: &str = "KHR_draco_mesh_compression";

/// Triangles that a byte may stand for. Real ones take half a byte or more.
const TRIANGLES_PER_BYTE: u64 = 16;

/// The compressed geometry of a primitive.
pub(super) struct Decoded {
    /// Three for each triangle.
    pub(super) corners: Vec<u32>,
    /// The accessors that it stands for, by their number.
    pub(super) attributes: HashMap<usize, Packed>,
}

/// The compressed primitives of the document, by mesh and primitive; `bytes` counts what was decompressed so far.
pub(super) fn all(
    root: &Root,
    buffers: &Buffers,
    limits: &Limits,
    mut bytes: u64,
) -> Result<HashMap<(usize, usize), Decoded>, Fault> {
    let mut all = HashMap::new();
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let Some(source) = extension(primitive) else { continue };
            let at = format!("/meshes/{m}/primitives/{p}/extensions/{NAME}");
            let mesh = mesh_of(root, buffers, source, limits, bytes, &at)?;
            let decoded = decoded(root, primitive, source, &mesh, &at)?;
            let size = decoded.attributes.values().map(|packed| packed.bytes.len() as u64).sum::<u64>();
            bytes = bytes.saturating_add(size + 4 * decoded.corners.len() as u64);
            all.insert((m, p), decoded);
        }
    }
    Ok(all)
}

/// The accessors that compressed primitives fill, which need no bytes of their own.
pub(super) fn filled(root: &Root) -> HashSet<usize> {
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let compressed = primitives.filter(|primitive| extension(primitive).is_some());
    compressed.flat_map(|p| p.attributes.values().chain(&p.indices)).map(Index::value).collect()
}

fn extension(primitive: &Primitive) -> Option<&Value> {
    primitive.extensions.as_ref()?.others.get(NAME)
}

fn mesh_of(
    root: &Root,
    buffers: &Buffers,
    source: &Value,
    limits: &Limits,
    before: u64,
    at: &str,
) -> Result<Mesh, Fault> {
    let view = source.get("bufferView").and_then(Value::as_u64).filter(|&view| view < root.buffer_views.len() as u64);
    let view = view.ok_or_else(|| Fault::invalid(format!("{at}/bufferView"), "this is no index of a buffer view"))?;
    let bytes = buffers.view(root, view as usize)?;
    // A mesh can be described by nearly nothing, so that its bytes alone bound no memory.
    let believed = limits.zeros.saturating_add(TRIANGLES_PER_BYTE * bytes.len() as u64).min(limits.triangles);
    let (left, ceiling) = (limits.decoded_bytes.saturating_sub(before), DecodeLimits::permissive());
    let ceiling = ceiling.with_max_faces(believed).with_max_points(limits.vertices).with_max_decoded_bytes(left);
    let mut mesh = Mesh::new();
    let mut stream = DecoderBuffer::new(bytes).with_limits(ceiling);
    MeshDecoder::new().decode(&mut stream, &mut mesh).map_err(|error| match error.kind() {
        ErrorKind::LimitExceeded | ErrorKind::AllocationExceedsInput => {
            let triangles = Limit("triangles", limits.triangles);
            let (zeros, decoded) = (Limit("zeros", limits.zeros), Limit(DECODED, limits.decoded_bytes));
            let what = "the Draco mesh announces more than its few bytes may, or than memory is meant to hold";
            Fault::too_large(at, format!("{what}: {zeros}, {triangles}, {decoded}"))
        }
        _ => Fault::invalid(at, format!("the Draco mesh cannot be decompressed ({})", error.message())),
    })?;
    Ok(mesh)
}

fn decoded(root: &Root, primitive: &Primitive, source: &Value, mesh: &Mesh, at: &str) -> Result<Decoded, Fault> {
    let mut decoded = Decoded { corners: Vec::with_capacity(3 * mesh.num_faces()), attributes: HashMap::new() };
    decoded.corners.extend(mesh.faces().as_flattened().iter().map(|point| point.0));
    let none = Map::new();
    for (name, id) in source.get("attributes").and_then(Value::as_object).unwrap_or(&none) {
        let named = |(semantic, _): &(&Checked<Semantic>, _)| semantic.to_string() == *name;
        // What the primitive does not have, the file does not ask for.
        let Some((_, accessor)) = primitive.attributes.iter().find(named) else { continue };
        let at = format!("{at}/attributes/{}", one_line(name));
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute = attribute.ok_or_else(|| Fault::invalid(&at, "the Draco mesh has no attribute of this id"))?;
        let packed = packed(root, *accessor, attribute, mesh.num_points(), &at)?;
        decoded.attributes.insert(accessor.value(), packed);
    }
    Ok(decoded)
}

/// The values of an attribute at all points, as the accessor has them.
fn packed(
    root: &Root,
    accessor: Index<Accessor>,
    attribute: &PointAttribute,
    points: usize,
    at: &str,
) -> Result<Packed, Fault> {
    let pointer = accessor::pointer(accessor);
    let accessor = root.get(accessor).ok_or_else(|| Fault::invalid(&pointer, "there is no such accessor"))?;
    let (component, kind) = accessor::layout(accessor, &pointer)?;
    let (have, want) = (usize::from(attribute.num_components()), kind.multiplicity());
    if have != want {
        let what = format!("the Draco mesh has {have} numbers a vertex here, and the accessor {pointer} {want}");
        return Err(Fault::invalid(at, what));
    }
    let data_type = attribute.data_type();
    let (size, stride) = (data_type.byte_length(), usize::try_from(attribute.byte_stride()).unwrap_or(0));
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * want * component.size());
    for point in 0..points {
        let value = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
        let element = value.checked_mul(stride).and_then(|start| data.get(start..)).and_then(|d| d.get(..want * size));
        let element =
            element.ok_or_else(|| Fault::invalid(at, format!("the Draco mesh has no value for vertex {point}")))?;
        if is_same(data_type, component) {
            bytes.extend_from_slice(element);
            continue;
        }
        for number in element.chunks_exact(size.max(1)) {
            push(&mut bytes, component, number_of(data_type, number)).ok_or_else(|| {
                Fault::invalid(at, format!("the value at vertex {point} is none of the type of the accessor {pointer}"))
            })?;
        }
    }
    Ok(Packed { bytes, count: points, component, kind, normalized: accessor.normalized })
}

fn is_same(kind: DataType, component: ComponentType) -> bool {
    matches!(
        (kind, component),
        (DataType::Float32, ComponentType::F32)
            | (DataType::Int8, ComponentType::I8)
            | (DataType::Uint8, ComponentType::U8)
            | (DataType::Int16, ComponentType::I16)
            | (DataType::Uint16, ComponentType::U16)
            | (DataType::Uint32, ComponentType::U32)
    )
}

/// A number of Draco's; NaN for kinds that glTF has no use for.
fn number_of(kind: DataType, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (DataType::Int8, &[a]) => f64::from(a.cast_signed()),
        (DataType::Uint8 | DataType::Bool, &[a]) => f64::from(a),
        (DataType::Int16, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (DataType::Uint16, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (DataType::Int32, &[a, b, c, d]) => f64::from(i32::from_le_bytes([a, b, c, d])),
        (DataType::Uint32, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (DataType::Float32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => f64::NAN,
    }
}

/// Adds a number in the accessor's type, if it is one of that.
fn push(bytes: &mut Vec<u8>, component: ComponentType, number: f64) -> Option<()> {
    let is = |converted: f64| (converted == number).then_some(());
    match component {
        ComponentType::I8 => is((number as i8).into()).map(|()| bytes.push((number as i8).cast_unsigned())),
        ComponentType::U8 => is((number as u8).into()).map(|()| bytes.push(number as u8)),
        ComponentType::I16 => is((number as i16).into()).map(|()| bytes.extend((number as i16).to_le_bytes())),
        ComponentType::U16 => is((number as u16).into()).map(|()| bytes.extend((number as u16).to_le_bytes())),
        ComponentType::U32 => is((number as u32).into()).map(|()| bytes.extend((number as u32).to_le_bytes())),
        ComponentType::F32 => is((number as f32).into()).map(|()| bytes.extend((number as f32).to_le_bytes())),
    }
}
