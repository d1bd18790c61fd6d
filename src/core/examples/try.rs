use glam::DVec3;
use palpate_core::{geometry::*, gripper::*, objects::*, physics::*, scene::*};
fn main() {
    for (name, shape, rot) in [
        ("ball", Primitive::Sphere { radius: 0.02 }, [0.; 3]),
        ("bigball", Primitive::Sphere { radius: 0.0325 }, [0.; 3]),
        (
            "cube",
            Primitive::Cuboid {
                half: DVec3::splat(0.0225),
            },
            [0.; 3],
        ),
        (
            "cyl",
            Primitive::Cylinder {
                radius: 0.0175,
                half_length: 0.03,
            },
            [0.; 3],
        ),
        (
            "lying",
            Primitive::Cylinder {
                radius: 0.009,
                half_length: 0.034,
            },
            [90., 0., 0.],
        ),
    ] {
        for fixed in [true, false] {
            let mut sc = Scene::default();
            sc.object.fixed = fixed;
            sc.object.rotation_deg = rot;
            if let Ok(a) = std::env::var("ACC") {
                sc.solver.accuracy = if a == "draft" {
                    Accuracy::Draft
                } else {
                    Accuracy::Reference
                };
            }
            let o = ObjectModel::from_primitive(name, shape, 400.0, 0.6);
            let reps = 5;
            let mut best = f64::MAX;
            let mut last = None;
            let mut ctot = 0u64;
            for _ in 0..reps {
                let (mut s, _p) = Simulation::new(&sc, Some(&o));
                let c = s.clock();
                let t = std::time::Instant::now();
                ctot = 0;
                let mut hold = None;
                for k in 0..c.total_ticks() {
                    if k % c.ticks_per_actuation as u64 == 0 {
                        let (b, ph) = sc.programme.command((k / c.ticks_per_actuation as u64) as u32);
                        s.command(b, ph);
                    }
                    let r = s.advance().unwrap();
                    ctot += r.contacts as u64;
                    if k == c.ticks_per_second as u64 * 3 - 1 {
                        hold = Some((s.frame(), s.contact_extremes(), s.object_wrench(), s.quality()));
                    }
                }
                best = best.min(t.elapsed().as_secs_f64() * 1e3);
                last = Some((s, hold));
            }
            let (s, hold) = last.unwrap();
            let (f, ext, w, qh) = hold.unwrap();
            let q = s.quality();
            println!(
                "{name:8} fixed={fixed:5} {best:6.2} ms {:.1} us/step newton {:.2}/{} unconv {} fres {:.3} sres {:.1e} ct {:.0} | F {:.3} {:.3} N  pen {:.2} mm cone {:.3} wrench {:.4?} obj {:.2?} mg {:.3}",
                best * 1e3 / s.tick() as f64,
                q.newton_mean,
                q.newton_max,
                q.unconverged_steps,
                q.friction_residual,
                qh.static_residual,
                ctot as f64 / s.tick() as f64,
                f.normal_force(Side::Left, 160),
                f.normal_force(Side::Right, 160),
                ext.0 * 1e3,
                ext.1,
                w.0.to_array(),
                f.world_from_object.unwrap().position.to_array().map(|x| x * 1e3),
                o.mass.mass * 9.80665
            );
        }
    }
}
