//! The visitor that sums several balls around one point at once: each point once, into its shell.

use crate::ball::{BallVisitor, DirectWalk};
use crate::block_sums::add_block;
use crate::moments::{Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::partition::partition;
use crate::simd::select::{BALL_LIMIT, BLOCK, Block};
use std::marker::PhantomData;

/// The shells between balls around one point, the largest first: what is in a ball and in no smaller one.
pub(crate) struct Shells {
    set: InstructionSet,
    /// Radii of the balls in units of the largest, hence 1 and less.
    radii: Vec<f64>,
    points: Vec<Box<Block>>,
    sums: Vec<Moments<f64>>,
    /// The points inside a ball whose shells are not told apart yet, and the same for the next.
    inside: Box<Block>,
    next_inside: Box<Block>,
}

impl Shells {
    pub fn new(set: InstructionSet, radii: &[f64]) -> Self {
        let block = || Box::new(Block::new());
        Self {
            set,
            radii: radii.to_vec(),
            points: radii.iter().map(|_| block()).collect(),
            sums: vec![Moments::default(); radii.len()],
            inside: block(),
            next_inside: block(),
        }
    }

    /// The moments of all balls around the query at this offset, each in units of its radius. `S` is what the
    /// sums within a block are kept in.
    pub fn moments<S: Scalar>(&mut self, walk: &mut DirectWalk<'_>, offset: [f32; 3]) -> &[Moments<f64>] {
        self.points.iter_mut().for_each(|points| points.len = 0);
        self.sums.fill(Moments::default());
        walk.visit(offset, &mut ShellVisitor::<S>(self, PhantomData));
        let mut ball = Moments::default();
        for ((points, sums), radius) in self.points.iter_mut().zip(&mut self.sums).zip(&self.radii).rev() {
            points.pad();
            add_block::<S>(sums, self.set, points, points.len);
            ball += *sums;
            *sums = ball.scaled(1.0 / radius);
        }
        &self.sums
    }
}

/// Deals the points to their shells.
struct ShellVisitor<'a, S>(&'a mut Shells, PhantomData<S>);

impl<S: Scalar> BallVisitor for ShellVisitor<'_, S> {
    const WANTS_RANKS: bool = false;

    fn visit(&mut self, block: &Block, len: usize) {
        let Shells { set, radii, points, sums, inside, next_inside } = &mut *self.0;
        let (mut members, mut len) = (block, len);
        let (smallest, shells) = points.split_last_mut().expect("there is a ball");
        for (shell, radius) in shells.iter_mut().zip(&radii[1..]) {
            let limit = (radius * radius * f64::from(BALL_LIMIT)) as f32;
            next_inside.len = 0;
            partition(*set, members, len, limit, next_inside, shell);
            std::mem::swap(inside, next_inside);
            (members, len) = (&*inside, inside.len);
        }
        smallest.append(members, len);
        for (points, sums) in points.iter_mut().zip(sums) {
            if points.len >= BLOCK {
                add_block::<S>(sums, *set, points, BLOCK);
                points.carry_over();
            }
        }
    }
}
