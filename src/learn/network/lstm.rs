//! Long short-term memory layer: forward pass and back-propagation through time over batches, and single live steps, in
//! workspaces that are allocated once.
//!
//! Arrays are time-major, `[steps][batch][..]`. Weights have PyTorch's shapes and gate order (input, forget, candidate,
//! output); its two biases, which occur only as their sum, are one here.

use super::gates::{add_row_product, step_backward, step_forward};
use super::gemm::{Matrix, multiply};

/// Borrowed weights of a layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct LstmWeights<'a> {
    /// Input weights, `[4 units][inputs]`.
    pub(super) w: &'a [f32],
    /// Recurrent weights, `[4 units][units]`.
    pub(super) u: &'a [f32],
    /// Biases, `[4 units]`.
    pub(super) b: &'a [f32],
}

/// Borrowed gradients of the weights, overwritten.
#[derive(Debug)]
pub(super) struct LstmGradients<'a> {
    pub(super) w: &'a mut [f32],
    pub(super) u: &'a mut [f32],
    pub(super) b: &'a mut [f32],
}

/// Scratch memory of forward and backward passes.
#[derive(Clone, Debug)]
pub(super) struct LstmWorkspace {
    inputs: usize,
    units: usize,
    steps: usize,
    batch: usize,
    /// Sums, then activations, then gradients of the sums, `[steps][batch][4 units]`.
    gates: Vec<f32>,
    /// Hidden states, from the zero before the first step, `[steps + 1][batch][units]`.
    h: Vec<f32>,
    /// Cell states, as above.
    c: Vec<f32>,
    /// tanh of the cell states after each step, `[steps][batch][units]`.
    tanh_c: Vec<f32>,
    dh: Vec<f32>,
    dc: Vec<f32>,
}

impl LstmWorkspace {
    pub(super) fn new(inputs: usize, units: usize) -> Self {
        let none = Vec::new;
        Self {
            inputs,
            units,
            steps: 0,
            batch: 0,
            gates: none(),
            h: none(),
            c: none(),
            tanh_c: none(),
            dh: none(),
            dc: none(),
        }
    }

    /// Resizes for a batch; batches of one size allocate once.
    fn resize(&mut self, steps: usize, batch: usize) {
        (self.steps, self.batch) = (steps, batch);
        let state = batch * self.units;
        self.gates.resize(4 * steps * state, 0.0);
        for states in [&mut self.h, &mut self.c] {
            states.resize((steps + 1) * state, 0.0);
            states[..state].fill(0.0);
        }
        self.tanh_c.resize(steps * state, 0.0);
        self.dh.resize(state, 0.0);
        self.dc.resize(state, 0.0);
    }

    /// Runs a batch of sequences `x`, `[steps][batch][inputs]`, from zero states.
    pub(super) fn forward(&mut self, weights: LstmWeights<'_>, x: &[f32], steps: usize, batch: usize) {
        self.resize(steps, batch);
        let (units, state) = (self.units, batch * self.units);
        for row in self.gates.chunks_exact_mut(4 * units) {
            row.copy_from_slice(weights.b);
        }
        let x = Matrix::new(x, steps * batch, self.inputs);
        multiply(x, Matrix::new(weights.w, 4 * units, self.inputs).t(), 1.0, &mut self.gates);
        let recurrent = Matrix::new(weights.u, 4 * units, units).t();
        for step in 0..steps {
            let gates = &mut self.gates[4 * step * state..4 * (step + 1) * state];
            let (h_before, h) = self.h[step * state..(step + 2) * state].split_at_mut(state);
            let (c_before, c) = self.c[step * state..(step + 2) * state].split_at_mut(state);
            if step > 0 {
                multiply(Matrix::new(h_before, batch, units), recurrent, 1.0, gates);
            }
            step_forward(units, gates, c_before, c, &mut self.tanh_c[step * state..(step + 1) * state], h);
        }
    }

    #[cfg(test)]
    pub(super) fn subnormal_gradients(&self) -> usize {
        self.gates.iter().chain(&self.dh).chain(&self.dc).filter(|x| x.is_subnormal()).count()
    }

    /// Hidden states after a step, `[batch][units]`.
    pub(super) fn hidden(&self, step: usize) -> &[f32] {
        let state = self.batch * self.units;
        &self.h[(step + 1) * state..(step + 2) * state]
    }

    /// Back-propagates through the batch of the last forward pass. `read_out` adds the gradient of the loss with respect to
    /// the hidden states after a step, `[batch][units]`, to its argument.
    pub(super) fn backward(
        &mut self,
        weights: LstmWeights<'_>,
        x: &[f32],
        mut read_out: impl FnMut(usize, &mut [f32]),
        gradients: &mut LstmGradients<'_>,
    ) {
        let (units, batch, steps) = (self.units, self.batch, self.steps);
        let state = batch * units;
        self.dh.fill(0.0);
        self.dc.fill(0.0);
        for step in (0..steps).rev() {
            read_out(step, &mut self.dh);
            let gates = &mut self.gates[4 * step * state..4 * (step + 1) * state];
            let (c_before, tanh_c) =
                (&self.c[step * state..(step + 1) * state], &self.tanh_c[step * state..(step + 1) * state]);
            step_backward(units, gates, c_before, tanh_c, &self.dh, &mut self.dc);
            if step > 0 {
                let recurrent = Matrix::new(weights.u, 4 * units, units);
                multiply(Matrix::new(gates, batch, 4 * units), recurrent, 0.0, &mut self.dh);
            }
        }
        let d_sums = Matrix::new(&self.gates, steps * batch, 4 * units);
        multiply(d_sums.t(), Matrix::new(&self.h[..steps * state], steps * batch, units), 0.0, gradients.u);
        multiply(d_sums.t(), Matrix::new(x, steps * batch, self.inputs), 0.0, gradients.w);
        gradients.b.fill(0.0);
        for row in self.gates.chunks_exact(4 * units) {
            for (sum, d) in gradients.b.iter_mut().zip(row) {
                *sum += d;
            }
        }
    }
}

/// Weights in the order in which a single step reads them (transposed).
#[derive(Clone, Debug)]
pub(super) struct LiveLstm {
    units: usize,
    /// `[inputs][4 units]`.
    w: Vec<f32>,
    /// `[units][4 units]`.
    u: Vec<f32>,
    b: Vec<f32>,
}

/// State of one sequence.
#[derive(Clone, Debug)]
pub(super) struct LiveState {
    gates: Vec<f32>,
    h: Vec<f32>,
    c: Vec<f32>,
    c_before: Vec<f32>,
    tanh_c: Vec<f32>,
}

impl LiveLstm {
    pub(super) fn new(weights: LstmWeights<'_>, inputs: usize, units: usize) -> Self {
        let transposed = |from: &[f32], columns: usize| {
            (0..columns).flat_map(|j| from.iter().skip(j).step_by(columns).copied()).collect()
        };
        Self { units, w: transposed(weights.w, inputs), u: transposed(weights.u, units), b: weights.b.to_vec() }
    }

    pub(super) fn start(&self) -> LiveState {
        let zeros = || vec![0.0; self.units];
        LiveState { gates: self.b.clone(), h: zeros(), c: zeros(), c_before: zeros(), tanh_c: zeros() }
    }

    /// Takes one sample of all inputs; allocates nothing.
    pub(super) fn step(&self, state: &mut LiveState, x: &[f32]) {
        state.gates.copy_from_slice(&self.b);
        add_row_product(x, &self.w, &mut state.gates);
        add_row_product(&state.h, &self.u, &mut state.gates);
        std::mem::swap(&mut state.c, &mut state.c_before);
        step_forward(self.units, &mut state.gates, &state.c_before, &mut state.c, &mut state.tanh_c, &mut state.h);
    }
}

impl LiveState {
    /// Hidden state, `[units]`.
    pub(super) fn hidden(&self) -> &[f32] {
        &self.h
    }

    /// Returns to the start of a sequence.
    pub(super) fn reset(&mut self) {
        self.h.fill(0.0);
        self.c.fill(0.0);
    }
}
