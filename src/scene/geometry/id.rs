//! What primitives, meshes and materials are called.

/// The index of a material in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// Names a primitive of the scene: one in world space, or a triangle of an instance. World-space primitives come first
/// in the order, by which equal distances are decided; then instances, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PrimitiveId {
    /// [`Self::WORLD`], or one more than the instance's number.
    pub(super) instance: u32,
    /// In world space triangles first, then spheres; in an instance the triangle's number in its mesh.
    pub(super) index: u32,
}

impl PrimitiveId {
    /// No primitive.
    pub const NONE: Self = Self { instance: u32::MAX, index: u32::MAX };

    pub(super) const WORLD: u32 = 0;

    /// The world-space primitive of that number: triangles first, then spheres, each in the order in which they were
    /// added.
    pub const fn world(index: u32) -> Self {
        Self { instance: Self::WORLD, index }
    }

    /// Triangle `index` of the mesh of instance `instance`, both in the order in which they were added.
    ///
    /// # Panics
    /// If `instance` is 2³² − 2 or more.
    pub const fn of(instance: u32, index: u32) -> Self {
        assert!(instance < u32::MAX - 1, "instances are counted by fewer than 2³² − 2");
        Self { instance: instance + 1, index }
    }

    /// The number of the instance that the primitive belongs to; `None` in world space.
    #[inline]
    pub const fn instance(self) -> Option<u32> {
        self.instance.checked_sub(1)
    }

    /// The number in world space, or of the triangle in its mesh.
    #[inline]
    pub const fn index(self) -> u32 {
        self.index
    }

    /// Both numbers, for [`Self::of_words`].
    #[inline(always)]
    pub(crate) fn words(self) -> [u32; 2] {
        [self.instance, self.index]
    }

    /// What has given these words.
    #[inline(always)]
    pub(crate) fn of_words([instance, index]: [u32; 2]) -> Self {
        Self { instance, index }
    }

    /// The number within `instance` (as the field of that name), or one that no primitive has.
    #[inline]
    pub(super) fn index_in(self, instance: u32) -> u32 {
        if self.instance == instance { self.index } else { u32::MAX }
    }
}

/// Names a mesh that is kept once for all of its instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshId(pub u32);
