//! Which tests are to notice which mistake.

use crate::list::Mistake;

/// A test: in the library's own or in `tests/transport`, or what a person does who distrusts the renderer on a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Test {
    Lib(&'static str),
    Transport(&'static str),
    /// `pathspace verify` of a scene, which has to end with exit code 1.
    Verify(&'static str),
}

use Test::{Lib, Transport, Verify};

const TEXTURES: Test = Transport("identity::of_every_path_over_textures");
const ZOO: Test = Transport("identity::of_every_path_among_all_materials_and_lights");
const VEILS: Test = Transport("identity::of_every_path_through_and_between_veils");
const SPHERE: Test = Transport("closed_forms::furnaces::every_path_length_has_its_power_of_the_albedo_in_a_sphere");
const REFRACTION: Test = Lib("path::tests::a_refraction_keeps_its_jacobian_in_both_densities");
const COUNTS: Test = Lib("path::strategy::tests::counts_follow_the_sensor_and_the_table_ends_at_max_depth");
const LENS: Test = Lib("scene::camera::tests::importance_over_density_counts_the_camera_subpaths_of_a_pass");

/// The tests that a mistake is tried on, the cheapest first.
pub fn killers(mistake: Mistake) -> &'static [Test] {
    use Mistake::*;
    match mistake {
        NoShadingFactor => &[Verify("scenes/textured-room.glb")],
        TiltLeftOut => &[Transport("normals::an_invisible_pane_has_no_rim")],
        TiltJacobian => &[Lib("scene::tilt::tests::the_jacobian_is_that_of_solid_angles")],
        ShadingCosine => &[TEXTURES],
        NoEtaSquared | UnitDelta => &[REFRACTION],
        SwappedEta => &[Lib("scene::bsdf::fresnel::tests::reflectance_of_glass_water_and_flint")],
        DimGlass => &[Lib("scene::bsdf::tests::smooth_clear_glass_loses_nothing")],
        NoPiInCosine => &[Lib("path::tests::an_environment_is_hit_sampled_and_seen")],
        NoHalfVectorJacobian => {
            &[Lib("scene::bsdf::tests::density::samples_follow_their_densities_and_no_energy_is_gained")]
        }
        NoMultipleScattering | UndividedProduct => {
            &[Lib("scene::bsdf::tests::furnace::white_plastic_and_metal_lose_nothing")]
        }
        RoughnessNotSquared => &[Lib("io::tests::reading::materials_become_bsdfs")],
        NoCosineInArea | NoDistanceInArea => &[ZOO],
        NoCoverageInArea => &[VEILS],
        EmissionTwice | RouletteUndivided | RouletteInDensities | PointsShown => &[ZOO],
        TentativeUndivided => &[Transport("options::roulette_on_connections_changes_no_image")],
        SplitsUncounted => &[Transport("options::split_paths_change_no_image")],
        SharedVerticesUndivided => &[COUNTS],
        CoarseChoice => &[Lib("scene::light::tree_tests::a_crowd_hides_no_lamp")],
        RestUnscaled => &[Lib("sampling::choice::tests::shares_are_in_proportion_and_none_is_empty")],
        FairTree => &[Lib("scene::light::tree_tests::lights_are_chosen_as_often_as_their_probability_says")],
        LightsTwice => &[Transport("textures::a_textured_emitter_lights_a_point_as_its_texels_say")],
        NoLightChoice => &[Transport("textures::the_density_over_a_textured_emitter_integrates_to_one")],
        HeuristicHalfSquared => &[Lib("path::mis::tests::weights_over_the_table_sum_to_one")],
        NoCountsInWeights => &[ZOO],
        BothSidesAsOne => &[SPHERE],
        BrightPoint => &[Lib("path::tests::a_point_light_has_no_normal_and_is_never_hit")],
        SpotFalloff => &[Lib("scene::light::tests::a_spot_falls_off_as_specified")],
        SunDiskWithoutPi => &[Lib("path::tests::a_sun_shines_along_one_direction_through_the_scenes_disk")],
        EvenEmitter => &[Lib("scene::light::emission::tests::densities_integrate_to_one_and_follow_the_emission")],
        EnvironmentNoSine => &[Lib("scene::light::tests::a_maps_samples_follow_its_luminance")],
        EnvironmentBackwards => &[Lib("scene::light::tests::directions_are_where_the_convention_says")],
        LensTwice | CosineCubed => &[LENS],
        OpaqueToShadows => &[Transport("alpha::light_and_shadow_rays_pass_crossing_panes")],
        CoveredPoints => &[Lib("scene::coincident::tests::what_is_there_is_what_asking_every_surface_finds")],
        OwnPlaneSeen => &[Transport("range::a_hidden_light_takes_nothing_from_what_is_seen")],
        CulledCastShadows => &[Transport("back_faces::a_furnace_seen_through_its_wall_is_a_furnace")],
        AbsorptionOutside | AbsorptionUnconnected => &[Transport("glass::every_path_inside_glass_is_as_defined")],
        ConnectionsInEmptySpace => &[Transport("media::lamp_card_and_camera_are_in_a_body")],
        ExitKept => &[Transport("media::a_closed_slab_absorbs_between_its_reflections")],
        IndexAgainstVacuum => &[Transport("media::an_inner_body_of_the_same_index_only_absorbs")],
        MirroredFront => &[Lib("scene::geometry::tests::instance::an_instance_is_what_its_flattened_triangles_are")],
        ConstantOffset => {
            &[Lib("scene::geometry::tests::instance::the_error_of_a_surface_covers_the_way_out_and_back")]
        }
        TangentNotMirrored => {
            &[Lib("scene::geometry::attributes::tests::the_images_up_goes_through_a_mirror_with_its_surface")]
        }
        RoundedFar => &[Lib("io::tests::far::a_scene_looks_alike_wherever_it_lies")],
        TextureTurnedBackwards => &[Lib("io::tests::textures::samplers_transforms_and_sets_are_honoured")],
        FactorBeforeTexture => &[Lib("io::tests::factors::a_constant_texture_is_a_factor")],
        SrgbUndecoded => &[Lib("scene::texture::tests::colours_are_decoded_before_they_are_interpolated")],
        PaddingForgotten | PaddingSplats => &[COUNTS],
        ResidueLost => &[Lib("film::plane::tests::every_finite_f32_counts_exactly_in_any_order")],
        CarryLost => &[Lib("film::plane::tests::carries_of_either_sign_spill")],
        LongNamesUnmarked => &[Lib("film::exr::tests::long_names_are_marked_and_short_ones_are_not")],
        FilterOffCentre => &[Lib("film::tests::constant_radiance_is_constant_up_to_the_border")],
        HalvesByPairs => &[Lib("film::tests::passes_go_to_the_half_images_in_turn")],
        CropShiftsNumbers => &[Transport("exactness::a_crop_is_a_slice_of_the_full_image")],
        ThreadInSeed => &[Transport("exactness::any_number_of_threads_gives_the_same_bytes")],
    }
}

impl Test {
    /// As cargo names it, or as it is typed.
    pub fn name(self) -> String {
        match self {
            Lib(filter) => filter.to_owned(),
            Transport(filter) => format!("transport {filter}"),
            Verify(scene) => format!("pathspace verify {scene}"),
        }
    }
}
