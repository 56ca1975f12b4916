//! Signatures of queries, and how alike they are.

use crate::arrays::{array, present, room};
use crate::code::{Failure, guarded, surfsig_code};
use crate::extraction::surfsig_extraction;
use crate::status::surfsig_status;
use surfsig::{Extraction, FitAxes, Frame, SIGNATURE, Status, similarity, with_threads};

/// Numbers of a signature.
pub const SURFSIG_SIGNATURE: usize = 242;
const _: () = assert!(SURFSIG_SIGNATURE == SIGNATURE);

/// Makes the signatures of chosen queries, in the default frame. The first call of a process also makes the
/// frame, in some tens of milliseconds.
///
/// @param extraction Where the queries' surfaces are.
/// @param queries Numbers of queries, from 0, (count); null for the first count of them.
/// @param count How many; 0 does nothing.
/// @param signatures Where they are put: (count, 242) floats, row by row; NaN where there is none.
/// @param statuses Where it is put why, (count); null if nobody asks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_signatures(
    extraction: Option<&surfsig_extraction>,
    queries: *const u32,
    count: usize,
    signatures: *mut f32,
    statuses: *mut surfsig_status,
) -> surfsig_code {
    guarded(|| {
        let surfsig_extraction { found, threads, .. } = present(extraction, "extraction")?;
        let queries: Vec<usize> = if queries.is_null() {
            within(count.checked_sub(1), found)?;
            (0..count).collect()
        } else {
            // SAFETY: the caller gives `count` numbers.
            let queries = unsafe { array(queries, count, "queries") }?;
            within(queries.iter().max().map(|&query| query as usize), found)?;
            queries.iter().map(|&query| query as usize).collect()
        };
        // SAFETY: the caller gives room for `count` rows.
        let rows = unsafe { room(signatures.cast::<[f32; SIGNATURE]>(), count, "signatures") }?;
        let mut made: Vec<Status> = queries.iter().map(|&query| found.status[query]).collect();
        with_threads(*threads, || fill(found, &queries, rows, &mut made))?;
        if !statuses.is_null() {
            // SAFETY: the caller gives room for `count` bytes, and `made` has as many; their numbers are
            // the same in C, which status.rs asserts.
            unsafe { made.as_ptr().cast::<surfsig_status>().copy_to(statuses, count) };
        }
        Ok(())
    })
}

/// An error where the last query is not the extraction's.
fn within(last: Option<usize>, found: &Extraction) -> Result<(), Failure> {
    match last {
        Some(last) if last >= found.len() => {
            let message = format!("query {last} is outside an extraction of {} queries", found.len());
            Err(Failure::invalid_input(message))
        }
        _ => Ok(()),
    }
}

/// Fills the rows, and marks in `statuses`, which hold the fits' own, what the frame does not reach.
fn fill(found: &Extraction, queries: &[usize], rows: &mut [[f32; SIGNATURE]], statuses: &mut [Status]) {
    let frame = Frame::shared();
    // In patch units a side is 1, where each query has its own radius.
    let side = if found.radii.is_empty() { 2.0 * found.radius } else { 1.0 };
    let unit = |i: usize| found.radii.get(i).map_or(1.0, |radius| 2.0 * radius);
    match found.axes {
        FitAxes::Surface => {
            let curvatures: Vec<_> =
                queries.iter().map(|&i| [found.k1[i] * unit(i), found.k2[i] * unit(i)]).collect();
            frame.signatures_of_curvatures(side, &curvatures, rows, statuses);
        }
        FitAxes::Sensor => {
            let surfaces: Vec<_> = queries
                .iter()
                .map(|&i| {
                    let ([a, b, c, d, e, f], unit) = (found.coefficients[i], unit(i));
                    [a * unit, b * unit, c, d, e * unit, f / unit]
                })
                .collect();
            frame.signatures_of_surfaces(side, &surfaces, rows, statuses);
        }
    }
}

/// Length of a flat atom for surfsig_similarities(): one more coordinate, the same for all signatures, that tells "flat
/// within its error" from "slightly curved". It follows the median standard error of the mean curvature. 0 where no
/// query has one, where the noise is beyond the vocabulary, and for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_flat_atom_length(extraction: Option<&surfsig_extraction>) -> f64 {
    let mut length = 0.0;
    guarded(|| {
        let known = extraction.and_then(|extraction| extraction.found.flat_atom_length(Frame::shared()));
        length = known.unwrap_or_default();
        Ok(())
    });
    length
}

/// Compares all queries with one of them: where else its surface is. In the surface's axes.
///
/// @param extraction Where the queries' surfaces are.
/// @param query Number of a query, from 0.
/// @param flat_atom Length of the flat atom, finite, as surfsig_flat_atom_length() gives it; 0 for none.
/// @param zeta Where zeta of eq. (12) is put, (size) floats: of the more similar side where no viewpoint is known, NaN
/// where there is no signature.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_similarities(
    extraction: Option<&surfsig_extraction>,
    query: u32,
    flat_atom: f64,
    zeta: *mut f32,
) -> surfsig_code {
    guarded(|| {
        let surfsig_extraction { found, threads, .. } = present(extraction, "extraction")?;
        within(Some(query as usize), found)?;
        if !(flat_atom >= 0.0 && flat_atom.is_finite()) {
            return Err(Failure::invalid_input(format!("flat_atom must be 0 or above, not {flat_atom}")));
        }
        // SAFETY: the caller gives room for a number of each query.
        let zeta = unsafe { room(zeta, found.len(), "zeta") }?;
        let frame = Frame::shared();
        zeta.copy_from_slice(&with_threads(*threads, || {
            found.similarities(query as usize, flat_atom, frame)
        })?);
        Ok(())
    })
}

/// zeta of eq. (12): how alike the surfaces of two signatures are, from 0 to 1; 0.9 and above is optimal, 0.5
/// and above good. NaN where a signature is missing, zero, or null.
///
/// Both must have been made at the same radius, in the same axes. Where an extraction knew no viewpoint, it
/// may have seen the surface from its other side, from where the signature is another one.
///
/// @param a 242 floats.
/// @param b 242 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_similarity(a: *const f32, b: *const f32) -> f64 {
    let mut zeta = f64::NAN;
    guarded(|| {
        // SAFETY: the caller gives signatures.
        let (a, b) = unsafe { (array(a, SIGNATURE, "a")?, array(b, SIGNATURE, "b")?) };
        zeta = similarity(a, b);
        Ok(())
    });
    zeta
}
