//! Plans: the audit refuses what it must, files keep every bit, blocks hold what the plan says.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::formats::{machine, plan_file, svg};
use ftheta::model::block::Block;
use ftheta::model::machine::Lens;
use ftheta::model::plan::{Motion, PlanDraft};
use ftheta::model::recipe::Recipe;
use ftheta::model::space::FieldPoint;
use ftheta::physics::audit::AuditError;
use ftheta::physics::optics::angles_from_field;
use ftheta::physics::plan::Plan;
use ftheta::planner::classic::{self, Settings};
use ftheta::planner::render::Renderer;
use ftheta::toolpath::lay::{LayOptions, lay};

const DRAWING: &[u8] = br#"<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="20mm"
    viewBox="0 0 20 20" fill="none" stroke="black">
    <path d="M2 2 L18 2 L18 9"/><circle cx="8" cy="12" r="5"/><path d="M15 18 Q 12 12 18 12"/>
    </svg>"#;

fn draft() -> PlanDraft {
    let recipe = Recipe::default();
    let job = svg::read(DRAWING, &recipe, &svg::SvgOptions::default()).unwrap().value;
    let machine = machine::preset("S10").unwrap().unwrap();
    let toolpath = lay(&job, &LayOptions::default()).unwrap().value;
    let settings = Settings::new(&machine, &recipe.classic).unwrap();
    classic::draft(toolpath, &machine, &settings, 0.01).unwrap()
}

/// The audit's answer to a plan that was tampered with.
fn refusal(tamper: impl FnOnce(&mut PlanDraft)) -> AuditError {
    let mut draft = draft();
    tamper(&mut draft);
    Plan::new(draft).expect_err("the audit must refuse")
}

#[test]
fn audit_refuses_light_off_the_marks() {
    let error = refusal(|draft| draft.marks[1].on_ns -= 400_000);
    assert!(matches!(error, AuditError::Light { edge: "on", .. }), "{error}");
    let error = refusal(|draft| draft.marks[0].off_ns += 400_000);
    assert!(matches!(error, AuditError::Light { edge: "off", .. }), "{error}");
    let error = refusal(|draft| draft.marks[0].off_ns = draft.marks[1].on_ns + 1);
    assert!(matches!(error, AuditError::Light { .. } | AuditError::Malformed { .. }), "{error}");
    let error = refusal(|draft| draft.marks[2].power_w = 21.0);
    assert!(matches!(error, AuditError::Power { limit_w: 20.0, .. }), "{error}");
}

#[test]
fn audit_refuses_gaps_and_wrong_indices() {
    let malformed = |error: AuditError| {
        assert!(matches!(error, AuditError::Malformed { .. }), "{error}");
    };
    malformed(refusal(|draft| draft.segments.clear()));
    // A length that its vertices do not have would let `render` run past the last one.
    malformed(refusal(|draft| {
        let travel = draft.segments.iter_mut().find_map(|segment| match &mut segment.motion {
            Motion::Travel { profile, .. } => Some(profile),
            Motion::Hold { .. } | Motion::Track { .. } | Motion::Drive { .. } => None,
        });
        travel.unwrap().length_mm *= 1.01;
    }));
    malformed(refusal(|draft| draft.segments.truncate(3)));
    malformed(refusal(|draft| draft.segments.swap(1, 3)));
    malformed(refusal(|draft| draft.segments[2].n_ticks = 0));
    malformed(refusal(|draft| draft.vertices[4].x = f64::NAN));
    malformed(refusal(|draft| draft.marks.truncate(1)));
    malformed(refusal(|draft| draft.pens.clear()));
    malformed(refusal(|draft| {
        let last = draft.segments.len() - 1;
        draft.segments[last].motion = Motion::Hold { vertex: u32::MAX };
    }));
}

#[test]
fn audit_refuses_what_the_motors_cannot() {
    let error = refusal(|draft| draft.machine.scanner.angle_max_rad = 0.01);
    assert!(matches!(error, AuditError::Limit { quantity: "commanded angle", .. }), "{error}");
    let error = refusal(|draft| draft.machine.scanner.speed_max_rad_s = 2.0);
    assert!(matches!(error, AuditError::Limit { quantity: "mirror speed", .. }), "{error}");
    let error = refusal(|draft| draft.machine.scanner.current_rms_a = 1e-3);
    assert!(matches!(error, AuditError::Limit { quantity: "coil heat", .. }), "{error}");
    let lens = Lens::FTheta { coefficients_mm: vec![1.0] };
    let far = refusal(|draft| {
        draft.machine.optics.lens = lens;
        draft.machine.scanner.angle_max_rad = 0.8;
        draft.machine.scanner.speed_max_rad_s = 1e6;
        draft.machine.scanner.voltage_max_v = 1e6;
        draft.machine.scanner.current_max_a = 1e6;
        draft.machine.scanner.current_rms_a = 1e6;
        draft.machine.output.word_range_rad = 1.0;
    });
    assert!(matches!(far, AuditError::Unreachable { .. }), "{far}");
}

/// A driver that clips is not the loop that was designed: the demand counts, not what is left.
#[test]
fn audit_refuses_saturation_and_words_out_of_range() {
    let error = refusal(|draft| draft.machine.scanner.voltage_max_v = 1.0);
    assert!(matches!(error, AuditError::Limit { quantity: "driver voltage", .. }), "{error}");
    let error = refusal(|draft| draft.machine.scanner.current_max_a = 0.2);
    assert!(matches!(error, AuditError::Limit { quantity: "coil current", .. }), "{error}");
    let error = refusal(|draft| draft.machine.output.word_range_rad = 0.02);
    assert!(error.to_string().contains("output word"), "{error}");
}

#[test]
fn plan_file_keeps_every_bit() {
    let plan = Plan::new(draft()).unwrap();
    let mut bytes = Vec::new();
    plan_file::write(&plan, &plan.id().to_string(), &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let (read, claimed) = plan_file::read(&text).unwrap();
    assert_eq!(claimed, plan.id().to_string());
    assert_eq!(Plan::new(read).unwrap().id(), plan.id());
    // Cut anywhere, it is never taken for whole.
    for end in (0..text.len() - 1).step_by(97) {
        assert!(plan_file::read(&text[..end]).is_err(), "cut at byte {end}");
    }
}

/// Blocks follow on, their words are within a step of the exact optics, and every edge is in the
/// block of its time.
#[test]
fn blocks_hold_what_the_plan_says() {
    let plan = Plan::new(draft()).unwrap();
    let period_ns = u64::from(plan.machine.output.period_ns);
    let step_rad = plan.machine.output.word_step_rad();
    let mut renderer = Renderer::new(&plan);
    let mut block = Block::default();
    let (mut n_samples, mut n_edges, mut last) = (0, 0, None);
    while renderer.next_block(&mut block) {
        assert_eq!(block.first_index, n_samples);
        n_samples += block.words.len() as u64;
        for edge in &block.edges {
            let mark = &plan.marks[n_edges / 2];
            let expected = if n_edges % 2 == 0 { mark.on_ns } else { mark.off_ns };
            assert_eq!(edge.time_ns, expected);
            assert!((block.first_index * period_ns..n_samples * period_ns).contains(&edge.time_ns));
            n_edges += 1;
        }
        last = block.words.last().copied().or(last);
    }
    assert_eq!((n_samples, n_edges), (plan.n_samples(), 2 * plan.marks.len()));
    assert_eq!(last, Some(Default::default()), "the beam comes back to the centre");
    // The end of the first mark's last segment is a vertex: its word is the rounded exact one.
    let mut sample = 0_u64;
    for segment in &plan.segments {
        sample += u64::from(segment.n_ticks);
        if segment.mark_index == Some(1) {
            break;
        }
    }
    let words: Vec<_> = {
        let mut renderer = Renderer::new(&plan);
        let mut all = Vec::new();
        while renderer.next_block(&mut block) {
            all.extend_from_slice(&block.words);
        }
        all
    };
    let Motion::Travel { first_vertex, n_vertices, .. } =
        plan.segments.iter().find(|segment| segment.mark_index == Some(1)).unwrap().motion
    else {
        panic!("a mark travels")
    };
    let vertex: FieldPoint = plan.vertices[(first_vertex + n_vertices) as usize - 1].into();
    let exact = angles_from_field(&plan.machine.optics, vertex).unwrap();
    let word = words[sample as usize - 1];
    assert!((f64::from(word.x) - exact.x_rad / step_rad).abs() <= 0.51);
    assert!((f64::from(word.y) - exact.y_rad / step_rad).abs() <= 0.51);
}
