//! The extensions that are read: one list, by which files are accepted or refused and which `docs/gltf.md` shows.

use super::limits::Drafts;

/// An extension that is read.
#[derive(Clone, Copy, Debug)]
pub struct Extension {
    /// As `extensionsUsed` has it.
    pub name: &'static str,
    /// Whether its page may still change.
    pub status: Status,
    /// What of it is read.
    pub read: &'static str,
    /// What of it is not, or not as it says; empty if nothing.
    pub limits: &'static str,
    /// The tests that read files with it, as `file::test` below `src/io/`.
    pub tests: &'static [&'static str],
}

/// How settled an extension is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Its page is settled.
    Settled,
    /// Its page is a draft: it is read on request.
    Draft,
}

/// Whether files may require this extension.
pub(super) fn is_read(name: &str, drafts: Drafts) -> bool {
    find(name).is_some_and(|extension| extension.status == Status::Settled || drafts == Drafts::Read)
}

/// Whether it would be read on request.
pub(super) fn is_draft(name: &str) -> bool {
    find(name).is_some_and(|extension| extension.status == Status::Draft)
}

fn find(name: &str) -> Option<&'static Extension> {
    EXTENSIONS.iter().find(|extension| extension.name == name)
}

const fn of(name: &'static str, read: &'static str, limits: &'static str, tests: &'static [&'static str]) -> Extension {
    Extension { name, status: Status::Settled, read, limits, tests }
}

const fn draft(
    name: &'static str,
    read: &'static str,
    limits: &'static str,
    tests: &'static [&'static str],
) -> Extension {
    Extension { status: Status::Draft, ..of(name, read, limits, tests) }
}

const ROUGHNESS: &str = "with `--drafts`: factor and texture";
const METADATA: &[&str] = &["tests/errors::metadata_is_no_reason_for_a_warning"];

const BENT: &str = "tests/layers::each_texture_multiplies_its_factor_by_its_channel";
const BSDFS: &str = "tests/reading::materials_become_bsdfs";
const COMPRESSED: &[&str] = &[
    "meshopt/tests::streams_of_meshoptimizer_are_what_its_decoder_makes_of_them",
    "meshopt/tests::a_compressed_triangle_is_the_plain_one",
];
const PLACES: &str = "tests/reading::spheres_scale_with_their_node";

/// The extensions that are read, in alphabetical order.
pub const EXTENSIONS: &[Extension] = &[
    of(
        "EXT_lights_ies",
        "IES LM-63 files of type C, multiplier and colour",
        "photometry of types A and B; TILT",
        &["tests/ies::a_profile_stands_in_its_nodes_frame", "tests/ies::horizontal_angles_are_continued_by_symmetry"],
    ),
    of(
        "EXT_lights_image_based",
        "the faces of the sharpest level, intensity, rotation",
        "blurred levels and irradiance coefficients: both are computed",
        &[
            "tests/image_light::faces_are_what_one_sees_from_the_middle_of_the_cube",
            "tests/image_light::a_constant_cube_has_the_irradiance_of_its_coefficients",
        ],
    ),
    draft("EXT_materials_diffuse_roughness", ROUGHNESS, "", &["tests/drafts::each_texture_multiplies_its_factor"]),
    of("EXT_mesh_features", "nothing: metadata", "", METADATA),
    of(
        "EXT_mesh_gpu_instancing",
        "TRANSLATION, ROTATION and SCALE of instances",
        "attributes of other names; a skinned mesh is there once",
        &["tests/instancing::gpu_instances_are_placed_by_their_attributes_below_the_node"],
    ),
    of("EXT_meshopt_compression", "all modes and filters", "", COMPRESSED),
    of("EXT_structural_metadata", "nothing: metadata", "", METADATA),
    of("EXT_texture_webp", "images", "", &["tests/textures::webp_of_the_extension_comes_before_the_fallback"]),
    of(
        "KHR_animation_pointer",
        "with `--at` and `--frames`: transforms, weights, visibility, cameras, lamps, factors of materials, transforms \
         of textures",
        "properties that are not read, or of drafts",
        &["tests/animation::whatever_can_be_animated_is_what_the_document_says_at_that_time"],
    ),
    of(
        "KHR_draco_mesh_compression",
        "bitstream 2.2, triangles",
        "other versions, point clouds",
        &["tests/draco::a_draco_mesh_is_what_it_is_whatever_else_is_announced"],
    ),
    of(
        "KHR_lights_punctual",
        "points, spots and suns",
        "`range`: light never ends",
        &["tests/reading::lights_and_cameras_stand_in_world_space"],
    ),
    of(
        "KHR_materials_anisotropy",
        "strength, rotation, texture",
        "",
        &["tests/layers::the_grain_turns_counter_clockwise_from_the_tangent", BENT],
    ),
    of(
        "KHR_materials_clearcoat",
        "factors, textures, normals",
        "",
        &["tests/layers::a_coat_without_a_normal_texture_has_the_meshs_normal", BENT],
    ),
    draft(
        "KHR_materials_coat",
        "with `--drafts`: factors, textures, normals, in place of `KHR_materials_clearcoat`",
        "the coat's anisotropy",
        &["tests/drafts::a_coat_comes_in_place_of_a_clear_coat", "tests/drafts::each_texture_multiplies_its_factor"],
    ),
    draft("KHR_materials_diffuse_roughness", ROUGHNESS, "", &["tests/drafts::each_texture_multiplies_its_factor"]),
    of(
        "KHR_materials_diffuse_transmission",
        "factors and textures",
        "as through a thin sheet, also on a volume; materials that transmit",
        &[BENT],
    ),
    of(
        "KHR_materials_dispersion",
        "dispersion, as a wavelength of each sample",
        "materials without a volume",
        &["tests/reading::volumes_disperse"],
    ),
    of(
        "KHR_materials_emissive_strength",
        "strength",
        "",
        &["tests/reading::emission_that_lamps_outshine_is_said_to_be"],
    ),
    draft(
        "KHR_materials_fuzz",
        "with `--drafts`: factors and textures, in place of `KHR_materials_sheen`",
        "roughness below 0.1",
        &["tests/drafts::fuzz_comes_in_place_of_sheen", "tests/drafts::each_texture_multiplies_its_factor"],
    ),
    of("KHR_materials_ior", "index of refraction, 0 too", "", &[BSDFS]),
    of("KHR_materials_iridescence", "factors and textures", "films thicker than 4095 nm", &[BENT]),
    of(
        "KHR_materials_pbrSpecularGlossiness",
        "converted to layers",
        "",
        &["tests/layers::speculars_and_glossiness_are_converted"],
    ),
    of("KHR_materials_sheen", "factors and textures", "roughness below 0.1", &[BENT]),
    of(
        "KHR_materials_specular",
        "factors and textures",
        "",
        &[BSDFS, "tests/textures::each_slot_multiplies_its_parameter"],
    ),
    of(
        "KHR_materials_transmission",
        "factor and texture, thin or with a volume",
        "materials between metal and glass that have no layers",
        &[BSDFS],
    ),
    of(
        "KHR_materials_unlit",
        "an emitter of the base colour",
        "",
        &["tests/textures::unlit_is_an_emitter_of_its_base_colour"],
    ),
    of("KHR_materials_variants", "with `--variant`", "", &["tests/variants::a_variant_gives_primitives_its_materials"]),
    of(
        "KHR_materials_volume",
        "attenuation, and whether there is a thickness",
        "the mesh bounds the volume, not its thickness",
        &[BSDFS, "tests/factors::an_attenuation_distance_of_zero_is_infinite"],
    ),
    of("KHR_mesh_quantization", "all types", "", &["tests/reading::sparse_and_quantized_accessors"]),
    of("KHR_meshopt_compression", "all modes and filters, versions 0 and 1", "", COMPRESSED),
    of(
        "KHR_node_visibility",
        "nodes and what is below them, also animated",
        "cameras are always there",
        &["tests/variants::invisible_nodes_are_not_there_but_for_cameras"],
    ),
    of(
        "KHR_texture_basisu",
        "ETC1S and UASTC, also with Zstandard",
        "the largest level, 8 bits per channel",
        &["tests/ktx2::files_of_basis_universal_are_what_its_decoder_makes_of_them"],
    ),
    of(
        "KHR_texture_transform",
        "offset, rotation, scale and set",
        "",
        &["tests/textures::samplers_transforms_and_sets_are_honoured"],
    ),
    of("KHR_xmp", "nothing: metadata", "", METADATA),
    of("KHR_xmp_json_ld", "nothing: metadata", "", METADATA),
    of(
        "PATHSPACE_materials_metal",
        "a measured metal by its symbol, of this project",
        "materials that transmit",
        &["tests/layers::a_metal_is_found_by_its_symbol"],
    ),
    of("PATHSPACE_sphere", "analytic spheres, of this project", "", &[PLACES]),
    of(
        "PATHSPACE_thin_lens",
        "lenses of cameras and their blades, of this project",
        "",
        &["tests/reading::lenses_and_orthographic_films_are_in_metres_of_the_world"],
    ),
];
