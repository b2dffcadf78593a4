"""Flags and dotted overrides: what wins over what, and what an unknown one is told."""

from __future__ import annotations

import pytest

from somatopy.cli.options import Options, parse
from somatopy.experiment import Description, DescriptionError, paper
from somatopy.experiment.description import FixedControl, Hebbian, OffsetDamage


def options(*args: str, description: Description | None = None) -> Options:
    return parse(args, description or paper(), "somatopy test", "Test.")


def described(*args: str, description: Description | None = None) -> Description:
    return options(*args, description=description).description


ONE_PHASE = paper().replaced(phases=(paper().phases[0],))


def test_without_options_the_description_is_as_it_was() -> None:
    """Nothing said, nothing changed."""
    assert described() == paper()
    assert (options().out, options().json, options().debug) == (None, False, False)


@pytest.mark.parametrize(
    ("args", "path", "value"),
    [
        (["--seed", "7"], "seed", 7),
        (["--eye", "geometric"], "eye.kind", "geometric"),
        (["--motion", "kinematic"], "body.motion", "kinematic"),
        (["--learner", "random"], "learner.kind", "random"),
        (["--minutes", "0.2"], "phases.0.frames", 180),
        (["--minutes", "0"], "phases.0.frames", 0),
        (["--damage-minutes", "10"], "phases.1.frames", 9000),
        (["--damage", "none"], "phases.1.damage.kind", "none"),
        (["--damage", "offset:0.1,-0.2,0,1e-1"], "phases.1.damage.offset", (0.1, -0.2, 0.0, 0.1)),
        (["--body.head-speed", "2"], "body.head_speed", 2.0),
        (["--body.head_speed=2"], "body.head_speed", 2.0),
        (["--babbling.range", "confined"], "babbling.range", "confined"),
        (["--babbling.speed", "0.5"], "babbling.speed", 0.5),
        (["--learner.arm-map.shape", "10", "12"], "learner.arm_map.shape", (10, 12)),
        (["--learner.link-rate", "0.5"], "learner.link_rate", 0.5),
        (["--phases.1.trend-breaks", "3", "9"], "phases.1.trend_breaks", (3, 9)),
        (["--phases.1.damage.offset", "1", "-1", "0", "0"], "phases.1.damage.offset", (1.0, -1.0, 0.0, 0.0)),
    ],
)
def test_each_option_sets_its_own_field_and_no_other(args: list[str], path: str, value: object) -> None:
    """Both spellings, lists, negative numbers; all that is not on the path stays."""
    before, after = paper().model_dump(), described(*args).model_dump()
    *parents, last = path.split(".")
    found, expected = after, before
    for key in parents:
        found, expected = (table[int(key)] if key.isdigit() else table[key] for table in (found, expected))
    assert found[last] == value
    if last == "kind":
        parent = path.rpartition(".")[0].split(".")
        *above, last = parent
        found, expected = after, before
        for key in above:
            found, expected = (table[int(key)] if key.isdigit() else table[key] for table in (found, expected))
    expected[last] = found[last]
    assert after == before


def test_a_range_in_numbers() -> None:
    """Pairs, one a joint, with negative numbers."""
    numbers = ["-1", "1", "0", "0.5", "-1", "1", "-1", "-0.5"]
    found = described("--babbling.range", *numbers).babbling.range
    assert found == ((-1.0, 1.0), (0.0, 0.5), (-1.0, 1.0), (-1.0, -0.5))


def test_file_then_short_then_dotted() -> None:
    """A short flag beats the file, a dotted one beats both, in whatever order they stand."""
    file = paper().replaced(body={"motion": "kinematic"}, babbling={"speed": 0.3})
    assert described(description=file).body.motion == "kinematic"
    assert described("--motion", "dynamic", description=file).body.motion == "dynamic"
    short, dotted = ["--motion", "dynamic"], ["--body.motion", "kinematic"]
    assert described(*short, *dotted).body.motion == described(*dotted, *short).body.motion == "kinematic"
    assert described("--phases.0.frames", "7", "--minutes", "1").phases[0].frames == 7
    assert described("--seed", "1", description=file).babbling.speed == 0.3


def test_a_short_flag_chooses_the_type_and_a_dotted_one_sets_its_field() -> None:
    """`--learner fixed` opens the fields of FixedControl; choosing the type that is there keeps its fields."""
    assert described("--learner", "fixed", "--learner.head", "0.5", "0.1").learner == FixedControl(head=(0.5, 0.1))
    file = paper().replaced(learner=Hebbian(link_rate=0.5))
    assert described("--learner", "hebbian", description=file).learner == Hebbian(link_rate=0.5)
    file = paper().replaced(learner={"kind": "random"})
    assert described("--learner", "hebbian", description=file).learner == Hebbian()


def test_damage_by_name() -> None:
    """`paper` is the paper's shift, whatever the file says."""
    file = described("--damage", "offset:1,1,1,1")
    assert described("--damage", "paper", description=file).phases[1].damage == OffsetDamage()


def test_a_damaged_phase_is_added_where_there_is_none() -> None:
    """Its default damage is the paper's; without these flags one phase stays one."""
    assert len(described("--minutes", "1", description=ONE_PHASE).phases) == 1
    for args, frames, kind in (
        (["--damage-minutes", "2"], 1800, "offset"),
        (["--damage", "none"], 0, "none"),
        (["--damage", "offset:1,0,0,0", "--damage-minutes", "1"], 900, "offset"),
    ):
        added = described(*args, description=ONE_PHASE).phases
        assert len(added) == 2 and added[0] == ONE_PHASE.phases[0]
        assert (added[1].frames, added[1].damage.kind) == (frames, kind)


def test_no_option_leaks_a_warning(recwarn: pytest.WarningsRecorder) -> None:
    """Building the command line is quiet, whatever damage, learner or range is chosen."""
    described("--damage", "offset:1,1,1,1", "--learner", "fixed", "--eye", "geometric")
    described("--babbling.range", *["-1", "1", "0", "0.5", "-1", "1", "-1", "-0.5"])
    assert [str(warning.message) for warning in recwarn] == []


@pytest.mark.parametrize(
    ("args", "valid"),
    [
        (["--babbling.sped", "1"], ["--babbling.kind", "--babbling.range", "--babbling.speed"]),
        (["--learner.head-map.eta", "1"], ["--learner.head-map.shape", "--learner.head-map.elasticity"]),
        (["--learner", "fixed", "--learner.arm-map.shape", "3", "3"], ["--learner.kind", "--learner.head"]),
        (["--phases.7.frames", "1"], ["--phases.0.frames", "--phases.1.damage.offset"]),
        (["--minuts", "1"], ["--minutes", "--damage-minutes", "--seed", "--learner.link-rate", "--body.model"]),
        (["--minuts=1"], ["--minutes", "--json"]),
    ],
)
def test_an_unknown_option_lists_the_valid_ones_near_it(args: list[str], valid: list[str]) -> None:
    """The innermost table it shares with valid keys, else all; the option is named."""
    with pytest.raises(DescriptionError) as caught:
        options(*args)
    message = str(caught.value)
    unknown = [arg for arg in args if arg.startswith("--")][-1].partition("=")[0]
    assert message.startswith(f"Unknown option {unknown}. Valid ones: ")
    listed = message.removesuffix(".").partition("Valid ones: ")[2].split(", ")
    assert set(valid) <= set(listed)
    if "." in unknown:
        assert all(key.startswith(unknown.partition(".")[0] + ".") for key in listed)


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["extra"], "'extra' was not expected here; options begin with --"),
        (["-x"], "'-x' was not expected here"),
        (["--minutes", "nan"], "finite and at least 0, not nan"),
        (["--damage-minutes", "-1"], "finite and at least 0, not -1"),
        (["--damage", "rust"], "--damage 'rust' is unknown; choose none, paper or offset:a,b,c,d"),
        (["--damage", "offset"], "choose none, paper or offset:a,b,c,d"),
        (["--damage", "offset:1,x,0,0"], "--damage 'offset:1,x,0,0': could not convert string to float: 'x'"),
        (["--damage", "offset:1,nan,0,0"], r"phases.1.damage.offset.1 = nan: .*finite"),
        (["--seed", "-1"], "seed = -1: .*greater than or equal to 0"),
        (["--name", "a b"], "name = 'a b'"),
        (["--phases.1.name", "intact"], "names of their own"),
    ],
)
def test_a_wrong_value_is_named(args: list[str], message: str) -> None:
    """What does not fit is a DescriptionError in one paragraph."""
    with pytest.raises(DescriptionError, match=message) as caught:
        options(*args)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "args",
    [
        ["--minutes", "soon"],
        ["--minutes"],
        ["--seed", "1.5"],
        ["--learner", "clever"],
        ["--eye", "third"],
        ["--babbling.speed", "-1"],
        ["--learner.arm-map.shape", "3"],
        ["--learner.arm-map.shape", "0", "3"],
        ["--learner.link-rate", "0"],
        ["--phases.0.frames", "-1"],
        ["--phases.1.trend-breaks", "7", "3"],
        ["--seed", "1", "2"],
    ],
)
def test_a_value_that_does_not_parse_exits_with_2_and_says_which(
    args: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """The last part of the option's name is on standard error, nothing on standard output."""
    with pytest.raises(SystemExit) as caught:
        options(*args)
    out, err = capsys.readouterr()
    assert caught.value.code == 2 and out == ""
    name = args[0].removeprefix("--").rpartition(".")[2]
    assert name in err.replace("_", "-") or ("2" in args and "Unrecognized" in err)
    assert "Traceback" not in err


def test_help_exits_with_0_and_shows_text_flags_and_dotted_keys(capsys: pytest.CaptureFixture[str]) -> None:
    """Of the learner that is chosen, wherever --help stands."""
    for args in (["--help"], ["-h"], ["--learner", "fixed", "--help"], ["--help", "--learner", "fixed"]):
        with pytest.raises(SystemExit) as caught:
            options(*args)
        out = capsys.readouterr().out
        assert caught.value.code == 0
        for word in ("Test.", "--seed", "--damage-minutes", "--json", "--babbling.speed", "--phases.1.damage.offset"):
            assert word in out
        assert ("--learner.head " in out) == ("fixed" in args) != ("--learner.arm-map.shape" in out)


@pytest.mark.parametrize("value", [True, False])
def test_a_dotted_truth_value_is_written_out(value: bool) -> None:
    """Like every other field, and without changing what --json means."""
    options = parse(["--eye.skip", str(value), "--json"], paper(), "program", "text")
    assert options.description.eye.skip is value and options.json
