"""What every complaint of the command line looks like, and what its JSON must hold."""

RECOVER_KEYS = {
    "domain", "objectives", "centre", "mode", "seed", "w_expert", "w", "intervals",
    "contains_expert", "l1_error", "relative_loss", "regret", "certificate", "forward_solves",
    "solves_to_1pct", "status", "seconds", "history", "recording", "versions",
}  # fmt: skip


def one_sentence(err):
    assert err.startswith("walking-irl: ") and err.count("\n") == 1, err
    assert "Traceback" not in err
    return err
