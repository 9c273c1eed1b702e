//! Which instructions the processor has: found when the program runs, so that one binary is right everywhere and fast
//! on what is common.
//!
//! Nothing is fused or reordered by them. Results are the same to the last bit with and without.

/// The instructions that hot code is compiled for; a value exists only where the processor has them.
#[derive(Clone, Copy, Debug)]
pub enum Instructions {
    /// Those of every processor of the architecture.
    Portable,
    /// See [`Avx2`].
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Instructions {
    /// The best set that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }
}

/// AVX2 and the bit counts of its time, on a processor that has them: the features `avx2`, `bmi1`, `bmi2`, `lzcnt` and
/// `popcnt`.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    /// Asks the processor.
    pub fn detect() -> Option<Self> {
        // The instructions that count bits came with AVX2 or before; walks use them on masks.
        let bits = std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("bmi2")
            && std::arch::is_x86_feature_detected!("lzcnt")
            && std::arch::is_x86_feature_detected!("popcnt");
        (bits && std::arch::is_x86_feature_detected!("avx2")).then_some(Self(()))
    }
}
