use surfsig::*;
fn main() {
    let b = std::fs::read(std::env::args().nth(1).unwrap()).unwrap();
    let r: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let p: Vec<[f32; 3]> = b
        .chunks_exact(12)
        .map(|c| [0, 4, 8].map(|i| f32::from_le_bytes(c[i..i + 4].try_into().unwrap())))
        .collect();
    let cloud = PointCloud::new(&p);
    for t in [1] {
        for _ in 0..4 {
            let s = std::time::Instant::now();
            let e = extract(
                &cloud,
                Radius::new(r).unwrap(),
                &ExtractOptions { threads: Some(t), ..Default::default() },
            )
            .unwrap();
            let el = s.elapsed().as_secs_f64();
            let n: f64 = e.count.iter().map(|c| *c as f64).sum::<f64>() / e.len() as f64;
            println!(
                "threads {t}: {:.3} s  {:.0} pts/s  mean n {n:.1} ok {} res {}",
                el,
                e.len() as f64 / el,
                e.status.iter().filter(|s| **s == 0).count(),
                e.residual[1000]
            );
        }
    }
    let s = std::time::Instant::now();
    let i = CellIndex::new(&cloud, Radius::new(r).unwrap()).unwrap();
    println!("index {:.4} s {}", s.elapsed().as_secs_f64(), i.len());
}
