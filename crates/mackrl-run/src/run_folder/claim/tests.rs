use std::fs;

use super::*;

fn folder(parent: &tempfile::TempDir) -> Folder {
    Folder::open(parent.path()).unwrap()
}

/// What a process left that was killed, on some host and in some job.
fn leave(parent: &tempfile::TempDir, host: &str, job: Option<&str>) {
    let holder = Holder {
        host: host.to_owned(),
        process: 7,
        job: job.map(|id| Job {
            id: id.to_owned(),
            restarts: 0,
        }),
        scratch: None,
    };
    let text = serde_json::to_string(&holder).unwrap();
    fs::write(parent.path().join(LOCK), text).unwrap();
}

#[test]
fn a_claim_says_who_holds_it_keeps_others_out_and_leaves_nothing() {
    let parent = tempfile::tempdir().unwrap();
    let claim = Claim::acquire(&folder(&parent), Some(Path::new("/disk"))).unwrap();
    let own = Holder::own(Some(Path::new("/disk")));
    assert_eq!(
        Occupation::of(parent.path()),
        Occupation::Held(Some(own.clone()))
    );
    let refusal = Claim::acquire(&folder(&parent), None).unwrap_err().chain();
    let expected = format!(
        "another process is writing in {} ({own})",
        parent.path().display()
    );
    assert_eq!(refusal, expected);
    drop(claim);
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
    assert_eq!(Occupation::of(parent.path()), Occupation::Free);
}

#[test]
fn of_many_that_claim_at_once_one_does() {
    for _ in 0..20 {
        let parent = tempfile::tempdir().unwrap();
        fs::write(parent.path().join(LOCK), "").unwrap();
        let claim = || Claim::acquire(&Folder::open(parent.path()).unwrap(), None).ok();
        let claims: Vec<Option<Claim>> = thread::scope(|scope| {
            let threads: Vec<_> = (0..5).map(|_| scope.spawn(claim)).collect();
            threads.into_iter().map(|t| t.join().unwrap()).collect()
        });
        let held = claims.iter().flatten().filter(|claim| claim.is_held());
        assert_eq!(held.count(), 1);
        assert_eq!(claims.iter().flatten().count(), 1);
    }
}

#[test]
fn what_a_killed_process_of_this_host_left_is_taken_over_whatever_it_says() {
    for content in ["", "{\"ho", "\u{0}", "[1]"] {
        let parent = tempfile::tempdir().unwrap();
        fs::write(parent.path().join(LOCK), content).unwrap();
        assert_eq!(Occupation::of(parent.path()), Occupation::Free);
        assert!(Claim::acquire(&folder(&parent), None).unwrap().is_held());
    }
    let parent = tempfile::tempdir().unwrap();
    leave(&parent, &host(), Some("12_3"));
    assert!(Claim::acquire(&folder(&parent), None).unwrap().is_held());
}

#[test]
fn without_a_lock_a_claim_of_another_host_holds_by_its_job_alone() {
    let parent = tempfile::tempdir().unwrap();
    leave(&parent, "elsewhere", None);
    assert_eq!(Occupation::of(parent.path()), Occupation::Free);
    // Nothing that could be asked about, so nothing says that it has ended.
    leave(&parent, "elsewhere", Some("--help"));
    let there = Occupation::of(parent.path());
    assert!(
        matches!(there, Occupation::HeldByJob { is_free: true, .. }),
        "{there:?}"
    );
    let refusal = Claim::acquire(&folder(&parent), None).unwrap_err();
    assert!(
        refusal
            .chain()
            .ends_with("(process 7 on elsewhere, job --help)"),
        "{refusal}"
    );
}

#[cfg(unix)]
#[test]
fn a_claim_whose_file_was_replaced_is_not_held_and_removes_nothing() {
    let parent = tempfile::tempdir().unwrap();
    let claim = Claim::acquire(&folder(&parent), None).unwrap();
    fs::remove_file(parent.path().join(LOCK)).unwrap();
    let next = Claim::acquire(&folder(&parent), None).unwrap();
    assert!(!claim.is_held() && next.is_held());
    drop(claim);
    assert!(next.is_held_at(parent.path()));
}
