//! The element-wise half of a gated recurrent unit, forwards and backwards, fused over the gates of a row.

use crate::nn::lanes::{Element, Kernel, Lanes};

/// Columns of gates per hidden unit: candidate n, reset r, update z, and q, the hidden state's part of the candidate.
pub(crate) const GATES: usize = 4;

/// Turns pre-activations into gates and gives the next hidden state.
pub(super) struct Activate<'a, R> {
    pub(super) hidden: usize,
    pub(super) rows: usize,
    pub(super) previous: &'a [R],
    pub(super) gates: &'a mut [R],
    pub(super) next: &'a mut [R],
}

impl<E: Element> Kernel<E> for Activate<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let h = self.hidden;
        let states = self
            .previous
            .chunks_exact(h)
            .zip(self.next.chunks_exact_mut(h));
        for ((previous, next), gates) in states
            .zip(self.gates.chunks_exact_mut(GATES * h))
            .take(self.rows)
        {
            let [n_row, r_row, z_row, q_row] = gate_rows(gates, h);
            let one = lanes.splat(E::ONE);
            for at in (0..h).step_by(L::LANES) {
                let to = (at + L::LANES).min(h);
                let r = lanes.sigmoid(lanes.load(&r_row[at..to]));
                let z = lanes.sigmoid(lanes.load(&z_row[at..to]));
                let q = lanes.load(&q_row[at..to]);
                let n = lanes.tanh(lanes.mul_add(r, q, lanes.load(&n_row[at..to])));
                let kept = lanes.mul(z, lanes.load(&previous[at..to]));
                let state = lanes.mul_add(lanes.sub(one, z), n, kept);
                lanes.store(&mut n_row[at..to], n);
                lanes.store(&mut r_row[at..to], r);
                lanes.store(&mut z_row[at..to], z);
                lanes.store(&mut next[at..to], state);
            }
        }
    }
}

/// Turns gates into the gradients of their pre-activations, and the gradient of h' into its direct part z · dh' in h.
pub(super) struct Differentiate<'a, R> {
    pub(super) hidden: usize,
    pub(super) rows: usize,
    pub(super) previous: &'a [R],
    pub(super) gates: &'a mut [R],
    pub(super) gradient: &'a mut [R],
}

impl<E: Element> Kernel<E> for Differentiate<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let h = self.hidden;
        let states = self
            .previous
            .chunks_exact(h)
            .zip(self.gradient.chunks_exact_mut(h));
        for ((previous, gradient), gates) in states
            .zip(self.gates.chunks_exact_mut(GATES * h))
            .take(self.rows)
        {
            let [n_row, r_row, z_row, q_row] = gate_rows(gates, h);
            let one = lanes.splat(E::ONE);
            for at in (0..h).step_by(L::LANES) {
                let to = (at + L::LANES).min(h);
                let (n, r) = (lanes.load(&n_row[at..to]), lanes.load(&r_row[at..to]));
                let (z, q) = (lanes.load(&z_row[at..to]), lanes.load(&q_row[at..to]));
                let (previous, dh) = (lanes.load(&previous[at..to]), lanes.load(&gradient[at..to]));
                let not_z = lanes.sub(one, z);
                let slope = lanes.sub(one, lanes.mul(n, n));
                let dn = lanes.mul(lanes.mul(dh, not_z), slope);
                let dq = lanes.mul(dn, r);
                let dr = lanes.mul(lanes.mul(dq, q), lanes.sub(one, r));
                let direct = lanes.mul(dh, z);
                let dz = lanes.mul(lanes.mul(direct, not_z), lanes.sub(previous, n));
                lanes.store(&mut n_row[at..to], dn);
                lanes.store(&mut r_row[at..to], dr);
                lanes.store(&mut z_row[at..to], dz);
                lanes.store(&mut q_row[at..to], dq);
                lanes.store(&mut gradient[at..to], direct);
            }
        }
    }
}

/// The four parts of a row of gates.
#[inline(always)]
fn gate_rows<R>(gates: &mut [R], hidden: usize) -> [&mut [R]; GATES] {
    let (n, rest) = gates.split_at_mut(hidden);
    let (r, rest) = rest.split_at_mut(hidden);
    let (z, q) = rest.split_at_mut(hidden);
    [n, r, z, q]
}
