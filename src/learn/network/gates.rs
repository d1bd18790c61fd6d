//! Elementwise part of an LSTM, compiled twice: for any processor, and for AVX2 with FMA, chosen at run time.
//!
//! Gates are in the order input, forget, candidate, output, as in PyTorch and candle:
//! c' = f c + i g, h = o tanh(c').

/// Gradients smaller than this are set to zero: those of a late read-out decay to subnormal numbers towards the first
/// steps, on which processors are five to ten times slower.
const NEGLIGIBLE: f32 = 1e-20;

/// Computes e^x by the polynomial of Cephes, without branches; relative error below 2e-7 from -87 to 88, clamped beyond.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    // Rounds to the nearest integer by pushing the fraction out of the mantissa.
    const ROUNDER: f32 = 12_582_912.0;
    let x = x.clamp(-87.0, 88.0);
    let rounded = x * std::f32::consts::LOG2_E + ROUNDER;
    let n = rounded - ROUNDER;
    // ln 2 in two parts, so that the remainder keeps its digits.
    let r = x - n * 0.693_359_4;
    let r = r + n * 2.121_944_4e-4;
    let mut p = 1.987_569_2e-4;
    p = p * r + 1.398_199_9e-3;
    p = p * r + 8.333_452e-3;
    p = p * r + 4.166_579_6e-2;
    p = p * r + 0.166_666_65;
    p = p * r + 0.5;
    // Floats near the rounder are one apart, so the lowest bits hold n.
    let power = f32::from_bits(rounded.to_bits().wrapping_sub(ROUNDER.to_bits()).wrapping_add(127) << 23);
    (p * r * r + r + 1.0) * power
}

#[inline(always)]
pub(super) fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + exp(-x))
}

#[inline(always)]
pub(super) fn tanh(x: f32) -> f32 {
    1.0 - 2.0 / (1.0 + exp(2.0 * x))
}

/// Defines a function that runs its body compiled for AVX2 where available.
macro_rules! dispatched {
    ($(#[$doc:meta])* $name:ident, $body:ident, ($($argument:ident: $kind:ty),*)) => {
        $(#[$doc])*
        pub(crate) fn $name($($argument: $kind),*) {
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                #[target_feature(enable = "avx2,fma")]
                fn wide($($argument: $kind),*) {
                    $body($($argument),*);
                }
                #[expect(unsafe_code, reason = "code for AVX2 may run only on processors that have it")]
                // SAFETY: both features were detected above.
                return unsafe { wide($($argument),*) };
            }
            $body($($argument),*);
        }
    };
}

dispatched! {
    /// Computes one time step forward for a batch. `gates`, `[batch][4 units]`, holds sums on entry and activations on
    /// return; `c_before`, `c`, `tanh_c`, `h` are `[batch][units]`.
    step_forward, forward_body,
    (units: usize, gates: &mut [f32], c_before: &[f32], c: &mut [f32], tanh_c: &mut [f32], h: &mut [f32])
}

/// Units computed together: local arrays of this width cannot alias other memory, so the compiler uses whole vectors.
const LANES: usize = 16;

#[inline(always)]
fn lanes(f: impl Fn(usize) -> f32) -> [f32; LANES] {
    std::array::from_fn(f)
}

#[inline(always)]
fn forward_body(units: usize, gates: &mut [f32], c_before: &[f32], c: &mut [f32], tanh_c: &mut [f32], h: &mut [f32]) {
    let rows = gates.chunks_exact_mut(4 * units).zip(c_before.chunks_exact(units));
    let outs = c.chunks_exact_mut(units).zip(tanh_c.chunks_exact_mut(units)).zip(h.chunks_exact_mut(units));
    for ((gates, c_before), ((c, tanh_c), h)) in rows.zip(outs) {
        let (i, rest) = gates.split_at_mut(units);
        let (f, rest) = rest.split_at_mut(units);
        let (g, o) = rest.split_at_mut(units);
        let ((i, i_rest), (f, f_rest)) = (i.as_chunks_mut::<LANES>(), f.as_chunks_mut::<LANES>());
        let ((g, g_rest), (o, o_rest)) = (g.as_chunks_mut::<LANES>(), o.as_chunks_mut::<LANES>());
        let ((before, before_rest), (c, c_rest)) = (c_before.as_chunks::<LANES>(), c.as_chunks_mut::<LANES>());
        let ((t, t_rest), (h, h_rest)) = (tanh_c.as_chunks_mut::<LANES>(), h.as_chunks_mut::<LANES>());
        let sums = i.iter_mut().zip(f).zip(g.iter_mut().zip(o));
        let states = before.iter().zip(c).zip(t.iter_mut().zip(h));
        for (((i, f), (g, o)), ((before, c), (t, h))) in sums.zip(states) {
            let (input, forget) = (lanes(|k| sigmoid(i[k])), lanes(|k| sigmoid(f[k])));
            let (candidate, output) = (lanes(|k| tanh(g[k])), lanes(|k| sigmoid(o[k])));
            let cell = lanes(|k| forget[k] * before[k] + input[k] * candidate[k]);
            let bent = lanes(|k| tanh(cell[k]));
            (*i, *f, *g, *o, *c, *t) = (input, forget, candidate, output, cell, bent);
            *h = lanes(|k| output[k] * bent[k]);
        }
        for k in 0..i_rest.len() {
            let (input, forget) = (sigmoid(i_rest[k]), sigmoid(f_rest[k]));
            let (candidate, output) = (tanh(g_rest[k]), sigmoid(o_rest[k]));
            (i_rest[k], f_rest[k], g_rest[k], o_rest[k]) = (input, forget, candidate, output);
            c_rest[k] = forget * before_rest[k] + input * candidate;
            t_rest[k] = tanh(c_rest[k]);
            h_rest[k] = output * t_rest[k];
        }
    }
}

dispatched! {
    /// Computes one time step back. `gates` holds activations on entry and gradients of the sums on return; `dc` holds the
    /// gradient of the cell state on entry and that of the state before on return.
    step_backward, backward_body,
    (units: usize, gates: &mut [f32], c_before: &[f32], tanh_c: &[f32], dh: &[f32], dc: &mut [f32])
}

#[inline(always)]
fn backward_body(units: usize, gates: &mut [f32], c_before: &[f32], tanh_c: &[f32], dh: &[f32], dc: &mut [f32]) {
    let rows = gates.chunks_exact_mut(4 * units).zip(c_before.chunks_exact(units));
    let outs = tanh_c.chunks_exact(units).zip(dh.chunks_exact(units)).zip(dc.chunks_exact_mut(units));
    for ((gates, c_before), ((tanh_c, dh), dc)) in rows.zip(outs) {
        let (i, rest) = gates.split_at_mut(units);
        let (f, rest) = rest.split_at_mut(units);
        let (g, o) = rest.split_at_mut(units);
        let (i, f, g, o) = (&mut i[..units], &mut f[..units], &mut g[..units], &mut o[..units]);
        let (c_before, tanh_c, dh, dc) = (&c_before[..units], &tanh_c[..units], &dh[..units], &mut dc[..units]);
        for j in 0..units {
            let (input, forget, candidate, output) = (i[j], f[j], g[j], o[j]);
            let (t, dh) = (tanh_c[j], flushed(dh[j]));
            let of_cell = flushed(dc[j] + dh * output * (1.0 - t * t));
            i[j] = of_cell * candidate * input * (1.0 - input);
            f[j] = of_cell * c_before[j] * forget * (1.0 - forget);
            g[j] = of_cell * input * (1.0 - candidate * candidate);
            o[j] = dh * t * output * (1.0 - output);
            dc[j] = of_cell * forget;
        }
    }
}

#[inline(always)]
fn flushed(x: f32) -> f32 {
    if x.abs() < NEGLIGIBLE { 0.0 } else { x }
}

dispatched! {
    /// Computes sums += x w, where `w` is `[inputs][outputs]`, four inputs at a time.
    add_row_product, row_product_body, (x: &[f32], w: &[f32], sums: &mut [f32])
}

#[inline(always)]
fn row_product_body(x: &[f32], w: &[f32], sums: &mut [f32]) {
    let width = sums.len();
    let (fours, rest) = x.as_chunks::<4>();
    for (k, [a, b, c, d]) in fours.iter().enumerate() {
        let rows = &w[4 * k * width..4 * (k + 1) * width];
        let (r0, rows) = rows.split_at(width);
        let (r1, rows) = rows.split_at(width);
        let (r2, r3) = rows.split_at(width);
        for ((((sum, r0), r1), r2), r3) in sums.iter_mut().zip(r0).zip(r1).zip(r2).zip(r3) {
            *sum += a * r0 + b * r1 + (c * r2 + d * r3);
        }
    }
    for (k, a) in rest.iter().enumerate() {
        let row = &w[(4 * fours.len() + k) * width..];
        for (sum, r) in sums.iter_mut().zip(row) {
            *sum += a * r;
        }
    }
}

dispatched! {
    /// Applies GELU, x / 2 (1 + tanh(sqrt(2 / pi) (x + 0.044715 x³))) (Hendrycks and Gimpel 2016), as candle does.
    gelu, gelu_body, (values: &mut [f32])
}

#[inline(always)]
fn gelu_body(values: &mut [f32]) {
    const SCALE: f32 = std::f32::consts::FRAC_2_SQRT_PI * std::f32::consts::FRAC_1_SQRT_2;
    let of = |x: f32| 0.5 * x * (1.0 + tanh(SCALE * (x + 0.044_715 * x * x * x)));
    let (whole, rest) = values.as_chunks_mut::<LANES>();
    whole.iter_mut().for_each(|own| *own = lanes(|k| of(own[k])));
    rest.iter_mut().for_each(|x| *x = of(*x));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_accurate_and_bounded() {
        for k in -8000..8000 {
            let x = k as f32 * 0.01;
            let (got, want) = (f64::from(exp(x)), f64::from(x).exp());
            assert!((got / want - 1.0).abs() < 3e-7, "exp({x}) = {got}");
            assert!((f64::from(tanh(x)) - f64::from(x).tanh()).abs() < 3e-7);
            assert!((f64::from(sigmoid(x)) - 1.0 / (1.0 + f64::from(-x).exp())).abs() < 3e-7);
        }
        for x in [f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(exp(x).is_finite() && tanh(x).abs() <= 1.0 && (0.0..=1.0).contains(&sigmoid(x)));
        }
    }

    #[test]
    fn wide_and_narrow_code_agree() {
        let mut seed = 1u32;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let units = 13;
        let before: Vec<f32> = (0..2 * units).map(|_| next()).collect();
        let sums: Vec<f32> = (0..8 * units).map(|_| 3.0 * next()).collect();
        type Forward = fn(usize, &mut [f32], &[f32], &mut [f32], &mut [f32], &mut [f32]);
        let run = |forward: Forward| {
            let mut gates = sums.clone();
            let mut outs = [(); 3].map(|()| vec![0.0; 2 * units]);
            let [c, t, h] = &mut outs;
            forward(units, &mut gates, &before, c, t, h);
            (gates, outs)
        };
        let (wide, narrow) = (run(step_forward), run(forward_body));
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close(&wide.0, &narrow.0) && wide.1.iter().zip(&narrow.1).all(|(a, b)| close(a, b)));

        let x: Vec<f32> = (0..7).map(|_| next()).collect();
        let w: Vec<f32> = (0..7 * 5).map(|_| next()).collect();
        let mut sums = [0.5; 5];
        add_row_product(&x, &w, &mut sums);
        for (j, sum) in sums.iter().enumerate() {
            let want = 0.5 + x.iter().enumerate().map(|(k, x)| x * w[5 * k + j]).sum::<f32>();
            assert!((sum - want).abs() < 1e-6);
        }
    }
}
