//! Which instructions the machine at hand has.

/// The instruction sets that the kernels are compiled for.
///
/// A value of this type is a proof that the running processor has the instructions: it can only be
/// made by asking the processor. All sets give the same bits: each kernel performs the same fused
/// operations on the same 16 virtual lanes, and only their number per instruction differs.
///
/// ```
/// use surfsig::InstructionSet;
/// let best = InstructionSet::detect();
/// assert!(InstructionSet::available().contains(&best));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionSet(pub(crate) Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// What the target's baseline offers. On aarch64 that is NEON with fused multiply-add; on an
    /// x86-64 without FMA the fused operations are emulated, which is slow and right.
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl InstructionSet {
    /// The widest set that this processor has.
    pub fn detect() -> Self {
        *Self::available().last().expect("the baseline is always there")
    }

    /// Every set that this processor has, the baseline first.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut, reason = "only x86-64 has more than its baseline")]
        let mut sets = vec![Self(Kind::Baseline)];
        #[cfg(target_arch = "x86_64")]
        {
            let fused = is_x86_feature_detected!("fma") && is_x86_feature_detected!("popcnt");
            if fused && is_x86_feature_detected!("avx2") {
                sets.push(Self(Kind::Avx2));
                if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
                    sets.push(Self(Kind::Avx512));
                }
            }
        }
        sets
    }

    /// Its name, for reports.
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Baseline if cfg!(target_arch = "aarch64") => "neon",
            Kind::Baseline => "plain",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => "avx512",
        }
    }
}

/// Compiles one body for every instruction set and writes the function that picks among them.
///
/// The body must be `#[inline(always)]`, so that it takes on the features of the function around it.
macro_rules! for_each_instruction_set {
    ($(#[$doc:meta])* $vis:vis fn $name:ident $(<$scalar:ident : $bound:path>)? ($($arg:ident : $type:ty),* $(,)?) $(-> $ret:ty)?
        { plain: $plain:expr, wide: $wide:expr, widest: $widest:expr $(,)? }) => {
        $(#[$doc])*
        $vis fn $name $(<$scalar: $bound>)? (set: $crate::simd::InstructionSet, $($arg: $type),*) $(-> $ret)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,popcnt")]
            fn avx2 $(<$scalar: $bound>)? ($($arg: $type),*) $(-> $ret)? {
                ($wide)($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx2,fma,popcnt")]
            fn avx512 $(<$scalar: $bound>)? ($($arg: $type),*) $(-> $ret)? {
                ($widest)($($arg),*)
            }
            match set.0 {
                $crate::simd::instruction_set::Kind::Baseline => ($plain)($($arg),*),
                // SAFETY: an `InstructionSet` with this value exists only where the processor has
                // reported AVX2, FMA and POPCNT.
                #[cfg(target_arch = "x86_64")]
                $crate::simd::instruction_set::Kind::Avx2 => unsafe { avx2($($arg),*) },
                // SAFETY: as above, and AVX-512 F and VL.
                #[cfg(target_arch = "x86_64")]
                $crate::simd::instruction_set::Kind::Avx512 => unsafe { avx512($($arg),*) },
            }
        }
    };
}
pub(crate) use for_each_instruction_set;
