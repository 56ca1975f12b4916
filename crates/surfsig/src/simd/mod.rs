//! The only rooms with `unsafe`: the kernels that touch every point of every ball, and the lanes
//! in which many fits are solved at once.

pub(crate) mod accumulate;
pub(crate) mod field;
pub(crate) mod instruction_set;
pub(crate) mod lanes;
pub(crate) mod partition;
pub(crate) mod products;
pub(crate) mod select;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod select_wasm;
#[cfg(target_arch = "x86_64")]
mod select_x86;
pub(crate) mod split;

pub use instruction_set::InstructionSet;
pub(crate) use instruction_set::for_each_instruction_set;
