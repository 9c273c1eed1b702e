//! Accessors: typed arrays in the buffers, read only where every byte was shown to be there.

use glam::{DMat4, Vec2, Vec3, Vec4};
use gltf_json::{
    Index, Root,
    accessor::{Accessor, ComponentType, Type},
    buffer::View,
    validation::Checked,
};

use super::{
    buffer::Buffers,
    draco::{self, Decoded},
    error::Fault,
    limits::{Limit, Limits},
};

/// Checks every buffer view and accessor of the document, used or not, against the sizes that it declares.
pub(super) fn check(root: &Root, limits: &Limits) -> Result<(), Fault> {
    for (i, view) in root.buffer_views.iter().enumerate() {
        let have = root.buffers.get(view.buffer.value()).map_or(0, |buffer| buffer.byte_length.0);
        let end = view.byte_offset.unwrap_or_default().0.checked_add(view.byte_length.0);
        if end.is_none_or(|end| end > have) {
            let what = format!("the view reaches beyond the {have} bytes of buffer {}", view.buffer.value());
            return Err(Fault::invalid(format!("/bufferViews/{i}"), what));
        }
    }
    let filled = draco::filled(root);
    for (i, accessor) in root.accessors.iter().enumerate() {
        let at = format!("/accessors/{i}");
        let size = Size { all: element_size(accessor, &at)?, last: last_element_size(accessor, &at)? };
        let limit = match accessor.buffer_view {
            // What is decompressed into an accessor is limited there.
            _ if filled.contains(&i) => Limit("vertices", limits.vertices),
            Some(_) => Limit("vertices", limits.vertices),
            // Nothing in the file bounds them.
            None => Limit("zeros", limits.zeros.min(limits.vertices)),
        };
        if accessor.count.0 > limit.1 {
            let what = format!("{} elements are announced, and {limit}", accessor.count.0);
            return Err(Fault::too_large(format!("{at}/count"), what));
        }
        if let Some(view) = accessor.buffer_view {
            span(root, view, accessor.byte_offset.unwrap_or_default().0, accessor.count.0, size, &at)?;
        }
        if let Some(sparse) = &accessor.sparse {
            let at = format!("{at}/sparse");
            if sparse.count.0 > accessor.count.0 {
                return Err(Fault::invalid(format!("{at}/count"), "there are more sparse elements than elements"));
            }
            let Checked::Valid(index) = &sparse.indices.component_type else {
                return Err(Fault::invalid(
                    format!("{at}/indices/componentType"),
                    "this component type does not exist",
                ));
            };
            let indices = &sparse.indices;
            span(root, indices.buffer_view, indices.byte_offset.0, sparse.count.0, Size::of(index.0.size()), &at)?;
            span(root, sparse.values.buffer_view, sparse.values.byte_offset.0, sparse.count.0, size, &at)?;
        }
    }
    Ok(())
}

/// Where an array lies in its buffer view, all of it.
struct Span {
    start: usize,
    stride: usize,
}

/// The bytes of an element.
#[derive(Clone, Copy)]
struct Size {
    all: usize,
    /// Of the last one, which needs no padding at its end.
    last: usize,
}

impl Size {
    fn of(element: usize) -> Self {
        Self { all: element, last: element }
    }
}

fn span(root: &Root, view: Index<View>, offset: u64, count: u64, size: Size, at: &str) -> Result<Span, Fault> {
    let Some(v) = root.buffer_views.get(view.value()) else {
        return Err(Fault::invalid(at, format!("there is no buffer view {}", view.value())));
    };
    let stride = v.byte_stride.map_or(size.all, |stride| stride.0);
    let end = (stride as u64)
        .checked_mul(count.saturating_sub(1))
        .and_then(|bytes| bytes.checked_add(if count == 0 { 0 } else { size.last as u64 })?.checked_add(offset));
    if end.is_none_or(|end| end > v.byte_length.0) {
        let what = format!(
            "{count} elements of {} bytes from byte {offset} do not fit into the {} bytes of buffer view {}",
            size.all,
            v.byte_length.0,
            view.value()
        );
        return Err(Fault::invalid(at, what));
    }
    let start = usize::try_from(offset);
    let start = start.map_err(|_| Fault::too_large(at, "an offset exceeds the machine's address space"))?;
    Ok(Span { start, stride })
}

pub(super) fn layout(accessor: &Accessor, at: &str) -> Result<(ComponentType, Type), Fault> {
    match (&accessor.component_type, &accessor.type_) {
        (Checked::Valid(component), Checked::Valid(kind)) => Ok((component.0, *kind)),
        (Checked::Invalid, _) => {
            Err(Fault::invalid(format!("{at}/componentType"), "this component type does not exist"))
        }
        (_, Checked::Invalid) => Err(Fault::invalid(format!("{at}/type"), "this accessor type does not exist")),
    }
}

/// The bytes of an element; the columns of a matrix begin on multiples of four.
fn element_size(accessor: &Accessor, at: &str) -> Result<usize, Fault> {
    let (component, kind) = layout(accessor, at)?;
    let rows = match kind {
        Type::Mat2 => 2,
        Type::Mat3 => 3,
        Type::Mat4 => 4,
        _ => return Ok(component.size() * kind.multiplicity()),
    };
    Ok((component.size() * rows).next_multiple_of(4) * rows)
}

/// The bytes of an element without the padding after the last column of a matrix.
fn last_element_size(accessor: &Accessor, at: &str) -> Result<usize, Fault> {
    let (component, kind) = layout(accessor, at)?;
    let rows = match kind {
        Type::Mat2 => 2,
        Type::Mat3 => 3,
        _ => return element_size(accessor, at),
    };
    let column = component.size() * rows;
    Ok(column.next_multiple_of(4) * (rows - 1) + column)
}

/// The accessors of a checked document.
#[derive(Clone, Copy)]
pub(super) struct Accessors<'a> {
    root: &'a Root,
    buffers: &'a Buffers,
    /// What some of them are, if they are those of a compressed primitive.
    decoded: Option<&'a Decoded>,
}

/// The elements of an accessor, packed, with its sparse elements put in.
#[derive(Clone)]
pub(super) struct Packed {
    pub(super) bytes: Vec<u8>,
    pub(super) count: usize,
    pub(super) component: ComponentType,
    pub(super) kind: Type,
    pub(super) normalized: bool,
}

impl<'a> Accessors<'a> {
    /// `root` has passed [`check`], and `buffers` are those of `root`.
    pub(super) fn new(root: &'a Root, buffers: &'a Buffers) -> Self {
        Self { root, buffers, decoded: None }
    }

    /// The accessors as a primitive uses them, which may be compressed.
    pub(super) fn of_primitive(self, mesh: usize, primitive: usize) -> Self {
        Self { decoded: self.buffers.primitives.get(&(mesh, primitive)), ..self }
    }

    /// Three corners for each triangle of a compressed primitive.
    pub(super) fn decoded_corners(&self) -> Option<&'a [u32]> {
        self.decoded.map(|decoded| &decoded.corners[..])
    }

    fn decoded(&self, index: Index<Accessor>) -> Option<&'a Packed> {
        self.decoded?.attributes.get(&index.value())
    }

    /// The number of elements.
    pub(super) fn count(&self, index: Index<Accessor>) -> usize {
        if let Some(packed) = self.decoded(index) {
            return packed.count;
        }
        self.root.get(index).map_or(0, |accessor| accessor.count.0 as usize)
    }

    /// The number of elements that the document announces of one that was decompressed.
    pub(super) fn announced(&self, index: Index<Accessor>) -> Option<usize> {
        self.decoded(index)?;
        self.root.get(index).map(|accessor| accessor.count.0 as usize)
    }

    /// Whether it has elements in a buffer: one without is all zeros.
    pub(super) fn has_data(&self, index: Index<Accessor>) -> bool {
        self.decoded(index).is_some() || self.root.get(index).is_some_and(|accessor| accessor.buffer_view.is_some())
    }

    /// Unsigned integers: the indices of a primitive.
    pub(super) fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, Fault> {
        let packed = self.packed(index, Type::Scalar, "a primitive's indices are scalars")?;
        if packed.normalized {
            return Err(Fault::invalid(pointer(index), "indices cannot be normalized"));
        }
        integers(&packed.bytes, packed.component).ok_or_else(|| {
            Fault::invalid(format!("{}/componentType", pointer(index)), "indices must be unsigned integers")
        })
    }

    /// Vectors of three floats, or of the integers that `KHR_mesh_quantization` admits. Not checked for being finite.
    pub(super) fn vec3(&self, index: Index<Accessor>) -> Result<Vec<Vec3>, Fault> {
        let numbers = self.numbers(index, Type::Vec3, "positions and normals have type VEC3")?;
        Ok(numbers.as_chunks::<3>().0.iter().map(|v| Vec3::from_array(*v)).collect())
    }

    /// Texture coordinates, in the same types. Not checked for being finite.
    pub(super) fn vec2(&self, index: Index<Accessor>) -> Result<Vec<Vec2>, Fault> {
        let numbers = self.numbers(index, Type::Vec2, "texture coordinates have type VEC2")?;
        Ok(numbers.as_chunks::<2>().0.iter().map(|v| Vec2::from_array(*v)).collect())
    }

    /// Tangents, rotations and weights, in the same types. Not checked for being finite.
    pub(super) fn vec4(&self, index: Index<Accessor>) -> Result<Vec<Vec4>, Fault> {
        let numbers = self.numbers(index, Type::Vec4, "rotations, weights and tangents have type VEC4")?;
        Ok(numbers.as_chunks::<4>().0.iter().map(|v| Vec4::from_array(*v)).collect())
    }

    /// Colours of three or four channels, the alpha 1 where there is none. Not checked for being finite.
    pub(super) fn colors(&self, index: Index<Accessor>) -> Result<Vec<Vec4>, Fault> {
        let three = self.root.get(index).is_some_and(|a| a.type_ == Checked::Valid(Type::Vec3));
        if three {
            return Ok(self.vec3(index)?.into_iter().map(|c| c.extend(1.0)).collect());
        }
        let numbers = self.numbers(index, Type::Vec4, "vertex colours have type VEC3 or VEC4")?;
        Ok(numbers.as_chunks::<4>().0.iter().map(|v| Vec4::from_array(*v)).collect())
    }

    /// Numbers alone, floats: the times of keys. Not checked for being finite.
    pub(super) fn scalars(&self, index: Index<Accessor>) -> Result<Vec<f32>, Fault> {
        let packed = self.packed(index, Type::Scalar, "the times of an animation are scalars")?;
        let numbers = match packed.component {
            ComponentType::F32 => floats(&packed),
            _ => None,
        };
        numbers.ok_or_else(|| {
            Fault::invalid(format!("{}/componentType", pointer(index)), "the times of an animation are floats")
        })
    }

    /// The values of an animation, whose elements are of this type: floats, or integers that stand for them. Not
    /// checked for being finite.
    pub(super) fn samples(&self, index: Index<Accessor>, kind: Type) -> Result<Vec<f32>, Fault> {
        let name = match kind {
            Type::Scalar => "SCALAR",
            Type::Vec2 => "VEC2",
            Type::Vec3 => "VEC3",
            _ => "VEC4",
        };
        let packed = self.packed(index, kind, &format!("what an animation makes of this has type {name}"))?;
        floats(&packed).ok_or_else(|| {
            let what = "the values of an animation are floats, or 8 or 16 bit integers";
            Fault::invalid(format!("{}/componentType", pointer(index)), what)
        })
    }

    fn numbers(&self, index: Index<Accessor>, kind: Type, rule: &str) -> Result<Vec<f32>, Fault> {
        let packed = self.packed(index, kind, rule)?;
        floats(&packed).ok_or_else(|| {
            let what = "vertex attributes are floats, or 8 or 16 bit integers";
            Fault::invalid(format!("{}/componentType", pointer(index)), what)
        })
    }

    /// The joints that move a vertex, as numbers within a skin.
    pub(super) fn joints(&self, index: Index<Accessor>) -> Result<Vec<[u16; 4]>, Fault> {
        let packed = self.packed(index, Type::Vec4, "joints have type VEC4")?;
        let numbers = match packed.component {
            ComponentType::U8 | ComponentType::U16 if !packed.normalized => integers(&packed.bytes, packed.component),
            _ => None,
        };
        let numbers = numbers.ok_or_else(|| {
            Fault::invalid(format!("{}/componentType", pointer(index)), "joints are unsigned 8 or 16 bit integers")
        })?;
        Ok(numbers.as_chunks::<4>().0.iter().map(|v| v.map(|joint| joint as u16)).collect())
    }

    /// Matrices of 4 × 4 floats.
    pub(super) fn mat4(&self, index: Index<Accessor>) -> Result<Vec<DMat4>, Fault> {
        let packed = self.packed(index, Type::Mat4, "inverse bind matrices have type MAT4")?;
        let numbers = match packed.component {
            ComponentType::F32 => floats(&packed),
            _ => None,
        };
        let numbers = numbers.ok_or_else(|| {
            Fault::invalid(format!("{}/componentType", pointer(index)), "inverse bind matrices are floats")
        })?;
        let matrices = numbers.as_chunks::<16>().0.iter();
        Ok(matrices.map(|m| DMat4::from_cols_array(&m.map(f64::from))).collect())
    }

    fn packed(&self, index: Index<Accessor>, kind: Type, rule: &str) -> Result<Packed, Fault> {
        let at = pointer(index);
        let accessor = self.root.get(index).ok_or_else(|| Fault::invalid(&at, "there is no such accessor"))?;
        let mut packed = match self.decoded(index) {
            Some(packed) => packed.clone(),
            None => self.stored(accessor, &at)?,
        };
        if packed.kind != kind {
            return Err(Fault::invalid(format!("{at}/type"), rule));
        }
        if let Some(sparse) = &accessor.sparse {
            let at = format!("{at}/sparse");
            let (count, size) = (packed.count, element_size(accessor, &at)?);
            let Checked::Valid(kind) = &sparse.indices.component_type else {
                return Err(Fault::invalid(at, "the component type of the indices does not exist"));
            };
            let n = sparse.count.0 as usize;
            let places =
                self.gather(sparse.indices.buffer_view, sparse.indices.byte_offset.0, n, kind.0.size(), &at)?;
            let places = integers(&places, kind.0)
                .ok_or_else(|| Fault::invalid(format!("{at}/indices"), "sparse indices must be unsigned integers"))?;
            let values = self.gather(sparse.values.buffer_view, sparse.values.byte_offset.0, n, size, &at)?;
            for (i, (&place, value)) in places.iter().zip(values.chunks_exact(size)).enumerate() {
                let place = place as usize;
                if place >= count {
                    let what = format!("element {i} is index {place}, and the accessor has {count} elements");
                    return Err(Fault::invalid(format!("{at}/indices"), what));
                }
                packed.bytes[place * size..(place + 1) * size].copy_from_slice(value);
            }
        }
        Ok(packed)
    }

    /// The elements as they are in a buffer, or zeros.
    fn stored(&self, accessor: &Accessor, at: &str) -> Result<Packed, Fault> {
        let (component, kind) = layout(accessor, at)?;
        let (size, count) = (element_size(accessor, at)?, accessor.count.0 as usize);
        let bytes = match accessor.buffer_view {
            Some(view) => self.gather(view, accessor.byte_offset.unwrap_or_default().0, count, size, at)?,
            None if accessor.count.0 > self.buffers.zeros => {
                let what = format!("{count} elements have no data, and {}", Limit("zeros", self.buffers.zeros));
                return Err(Fault::too_large(format!("{at}/count"), what));
            }
            None => vec![0; count * size],
        };
        Ok(Packed { bytes, count, component, kind, normalized: accessor.normalized })
    }

    fn gather(&self, view: Index<View>, offset: u64, count: usize, size: usize, at: &str) -> Result<Vec<u8>, Fault> {
        let Span { start, stride } = span(self.root, view, offset, count as u64, Size::of(size), at)?;
        let data = self.buffers.view(self.root, view.value())?.get(start..).unwrap_or(&[]);
        if stride == size {
            return Ok(data[..count * size].to_vec());
        }
        let mut out = Vec::with_capacity(count * size);
        for i in 0..count {
            out.extend_from_slice(&data[i * stride..i * stride + size]);
        }
        Ok(out)
    }
}

/// The JSON pointer of an accessor.
pub(super) fn pointer(index: Index<Accessor>) -> String {
    format!("/accessors/{}", index.value())
}

fn integers(bytes: &[u8], component: ComponentType) -> Option<Vec<u32>> {
    Some(match component {
        ComponentType::U8 => bytes.iter().map(|&b| u32::from(b)).collect(),
        ComponentType::U16 => bytes.as_chunks::<2>().0.iter().map(|&b| u32::from(u16::from_le_bytes(b))).collect(),
        ComponentType::U32 => bytes.as_chunks::<4>().0.iter().map(|&b| u32::from_le_bytes(b)).collect(),
        _ => return None,
    })
}

fn floats(packed: &Packed) -> Option<Vec<f32>> {
    let bytes = &packed.bytes;
    // glTF 2.0 specification, 3.6.2.2: c / (2^bits − 1), and −1 at least for signed types.
    let scale = |max: f32| if packed.normalized { 1.0 / max } else { 1.0 };
    let signed = |c: f32, max: f32| if packed.normalized { (c / max).max(-1.0) } else { c };
    Some(match packed.component {
        ComponentType::F32 => bytes.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
        ComponentType::U8 => bytes.iter().map(|&b| f32::from(b) * scale(255.0)).collect(),
        ComponentType::I8 => bytes.iter().map(|&b| signed(f32::from(b.cast_signed()), 127.0)).collect(),
        ComponentType::U16 => {
            bytes.as_chunks::<2>().0.iter().map(|&b| f32::from(u16::from_le_bytes(b)) * scale(65535.0)).collect()
        }
        ComponentType::I16 => {
            bytes.as_chunks::<2>().0.iter().map(|&b| signed(f32::from(i16::from_le_bytes(b)), 32767.0)).collect()
        }
        ComponentType::U32 => return None,
    })
}
