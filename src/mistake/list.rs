//! The planted mistakes by name: a file of its own, for the program that plants them is built without them.

macro_rules! mistakes {
    ($($name:ident $text:literal $what:literal;)*) => {
        /// A mistake that can be planted.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Mistake {
            $(#[doc = $what] $name,)*
        }

        impl Mistake {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// The name in `PATHSPACE_MISTAKE`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => $text,)* }
            }

            /// What is wrong.
            pub fn what(self) -> &'static str {
                match self { $(Self::$name => $what,)* }
            }

            /// The mistake of this name.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|mistake| mistake.name() == name)
            }
        }
    };
}

mistakes! {
    NoShadingFactor "no-shading-factor" "Walks from the light scatter over shading normals without the adjoint's factor (Veach 5.3).";
    ShadingCosine "shading-cosine" "A walk's throughput takes its cosine against N_s where G has N_g.";
    TiltLeftOut "tilt-left-out" "Directions between the horizons of N_s and N_g scatter nothing.";
    TiltJacobian "tilt-jacobian" "Directions are bent near the horizons without dω_s/dω.";
    NoEtaSquared "no-eta-squared" "Refracted radiance does not scale with 1/η².";
    UnitDelta "unit-delta" "The reverse density of a refraction lacks its Jacobian.";
    SwappedEta "swapped-eta" "Fresnel's equations take η_incident/η_transmitted.";
    DimGlass "dim-glass" "Glass and panes transmit 95 % of what they should.";
    NoPiInCosine "no-pi-in-cosine" "The density of cosine-distributed directions lacks its 1/π.";
    NoHalfVectorJacobian "no-half-vector-jacobian" "The density of a microfacet reflection lacks dω_h/dω = 1/(4 cos).";
    NoMultipleScattering "no-multiple-scattering" "Light that meets a second facet is lost, on metals, plastic and glass.";
    UndividedProduct "undivided-product" "The base under an interface, and light after several facets, are not divided by the mean of what reaches them.";
    RoughnessNotSquared "roughness-not-squared" "GGX's α is the roughness instead of its square.";
    NoCosineInArea "no-cosine-in-area" "dω becomes dA without the far end's cosine.";
    NoDistanceInArea "no-distance-in-area" "dω becomes dA without the squared distance.";
    NoCoverageInArea "no-coverage-in-area" "Densities of walks forget what they pass and where they stop by chance.";
    EmissionTwice "emission-twice" "The lecture's: L_e is added in full at vertices that next-event estimation has lit.";
    LightsTwice "lights-twice" "The lecture's: a light's sample is multiplied by their number and divided by its probability.";
    NoLightChoice "no-light-choice" "A light's density forgets the probability of choosing it.";
    HeuristicHalfSquared "heuristic-half-squared" "The power heuristic squares the ratios towards the light only.";
    NoCountsInWeights "no-counts-in-weights" "Weights compare densities without the numbers of samples.";
    RouletteUndivided "roulette-undivided" "A walk that survives roulette is not divided by its probability.";
    TentativeUndivided "tentative-undivided" "A connection that survives roulette is not divided by its probability.";
    SplitsUncounted "splits-uncounted" "The parts of a split subpath count as one sample.";
    CoarseChoice "coarse-choice" "Choices keep 24 of their 64 bits.";
    RestUnscaled "rest-unscaled" "What a choice leaves is not scaled to a choice of its own.";
    FairTree "fair-tree" "The density of a light from the tree is that of fair turns.";
    SharedVerticesUndivided "shared-vertices-undivided" "Connections to chosen light vertices count as if each subpath had one.";
    RouletteInDensities "roulette-in-densities" "Roulette's survival probability stands in a density of one side.";
    PointsShown "points-shown" "(1,1) shows point lights and suns.";
    BothSidesAsOne "both-sides-as-one" "The density of a two-sided emitter's directions is that of one side.";
    BrightPoint "bright-point" "Point lights are 1 % too bright.";
    SpotFalloff "spot-falloff" "A spot's falloff is linear instead of quadratic.";
    SunDiskWithoutPi "sun-disk-without-pi" "Rays of infinite lights have the density 1/R² on the disk.";
    EvenEmitter "even-emitter" "A textured emitter has the density of an even one.";
    EnvironmentNoSine "environment-no-sine" "Rows of an environment map count alike, whatever solid angle they have.";
    EnvironmentBackwards "environment-backwards" "An environment map is turned the wrong way.";
    LensTwice "lens-twice" "The density of a point on the lens is twice what it is.";
    CosineCubed "cosine-cubed" "Importance falls off with cos³ instead of cos⁴.";
    OpaqueToShadows "opaque-to-shadows" "Shadow rays do not pass what is there in part.";
    CoveredPoints "covered-points" "Points are there also where a coincident surface comes before theirs.";
    OwnPlaneSeen "own-plane-seen" "A point sees what lies in the plane of its own surface.";
    CulledCastShadows "culled-cast-shadows" "Connections to the lens do not pass back faces that the camera culls.";
    AbsorptionOutside "absorption-outside" "Light is absorbed in front of a volume's boundary.";
    AbsorptionUnconnected "absorption-unconnected" "Connections pass volumes unabsorbed.";
    ConnectionsInEmptySpace "connections-in-empty-space" "A connection does not know the medium that its walk is in.";
    ExitKept "exit-kept" "A walk that leaves a body stays in its medium.";
    IndexAgainstVacuum "index-against-vacuum" "η at an interface is that against empty space, whatever medium is before it.";
    MirroredFront "mirrored-front" "The front of a mirrored instance is its back.";
    ConstantOffset "constant-offset" "Rays start a constant distance off their surface.";
    RoundedFar "rounded-far" "Places far from the origin are rounded before they are re-centred.";
    TangentNotMirrored "tangent-not-mirrored" "A mirrored surface keeps the handedness of its tangents.";
    TextureTurnedBackwards "texture-turned-backwards" "A texture's transform turns it the wrong way.";
    FactorBeforeTexture "factor-before-texture" "What transmits is decided by the metallic factor without its texture.";
    SrgbUndecoded "srgb-undecoded" "8-bit colours are taken as linear.";
    PaddingForgotten "padding-forgotten" "Camera subpaths are counted without those of the padding.";
    PaddingSplats "padding-splats" "Light subpaths of the padding count among those that splat.";
    ResidueLost "residue-lost" "Deposits that are no multiples of the film's quantum are left out.";
    CarryLost "carry-lost" "What a word of the film loses when it wraps around is lost.";
    LongNamesUnmarked "long-names-unmarked" "OpenEXR files do not say that they have long names.";
    FilterOffCentre "filter-off-centre" "A filter is centred on the pixel's corner.";
    HalvesByPairs "halves-by-pairs" "Passes go to the half images two by two.";
    CropShiftsNumbers "crop-shifts-numbers" "Random numbers follow the place in the crop.";
    ThreadInSeed "thread-in-seed" "Random numbers depend on the thread.";
}
