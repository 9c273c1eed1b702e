//! Hashes of 32 bits in lanes: those of sobol_burley and rand_philox, which have them for one number at a time.

use crate::lanes::{Lanes, Unsigned};

/// [`sobol_burley::parts::hash`].
#[inline(always)]
pub fn hash<U: Unsigned>(n: U) -> U {
    let constant = |c| n.lanes().splat_u(c);
    let n = n ^ constant(0xe6fe_3beb);
    let n = (n ^ n >> 16).wrapping_mul(constant(0x7feb_352d));
    let n = (n ^ n >> 15).wrapping_mul(constant(0x846c_a68b));
    n ^ n >> 16
}

/// [`sobol_burley::parts::owen_scramble_rev`]: an Owen scramble of a number with its bits reversed.
#[inline(always)]
pub fn owen_scramble_rev<U: Unsigned>(n: U, scramble: U) -> U {
    let constant = |c| n.lanes().splat_u(c);
    let n = n ^ n.wrapping_mul(constant(0x3d20_adea));
    let n = n.wrapping_add(scramble).wrapping_mul(scramble >> 16 | constant(1));
    let n = n ^ n.wrapping_mul(constant(0x0552_6c56));
    n ^ n.wrapping_mul(constant(0x53a2_2864))
}

/// [`rand_philox::philox4x32_10`], with one key for all lanes.
#[inline(always)]
pub fn philox4x32_10<U: Unsigned>([mut a, mut b, mut c, mut d]: [U; 4], key: [u32; 2]) -> [U; 4] {
    let lanes = a.lanes();
    for round in 0..10_u32 {
        let key = |i: usize, step: u32| lanes.splat_u(key[i].wrapping_add(round.wrapping_mul(step)));
        let ((low_a, high_a), (low_c, high_c)) = (a.wide_mul(0xd251_1f53), c.wide_mul(0xcd9e_8d57));
        (a, b) = (high_c ^ b ^ key(0, 0x9e37_79b9), low_c);
        (c, d) = (high_a ^ d ^ key(1, 0xbb67_ae85), low_a);
    }
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lanes::Arrays;

    proptest! {
        #[test]
        fn hashes_are_those_of_the_crates(n in any::<[u32; 4]>(), m in any::<[u32; 4]>(), key in any::<[u32; 2]>()) {
            use sobol_burley::parts;

            prop_assert_eq!(hash(n[0]), parts::hash(n[0]));
            prop_assert_eq!(owen_scramble_rev(n[0], m[0]), parts::owen_scramble_rev(n[0], m[0]));
            prop_assert_eq!(philox4x32_10(n, key), rand_philox::philox4x32_10(n, key));

            // Of four lanes, each is given its numbers in another order.
            let turned = |n: [u32; 4], by: usize| [0, 1, 2, 3].map(|i| n[(i + by) % 4]);
            let load = |n: [u32; 4]| Arrays::<4>.load_u(&n);
            let words = |u: <Arrays<4> as Lanes>::U| {
                let mut words = [0; 4];
                u.store(&mut words);
                words
            };
            prop_assert_eq!(words(hash(load(n))), n.map(parts::hash));
            let scrambled = words(owen_scramble_rev(load(n), load(m)));
            prop_assert_eq!(scrambled, [0, 1, 2, 3].map(|i| parts::owen_scramble_rev(n[i], m[i])));
            let random = philox4x32_10([0, 1, 2, 3].map(|by| load(turned(n, by))), key).map(words);
            for lane in 0..4 {
                let alone = rand_philox::philox4x32_10(turned(n, lane), key);
                prop_assert_eq!(random.map(|word| word[lane]), alone);
            }
        }
    }
}
