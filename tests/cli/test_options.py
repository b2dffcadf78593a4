"""Flags and dotted overrides: what wins over what, and what an unknown one is told."""

from __future__ import annotations

import pytest

from somatopy.cli.mirror import mirrored
from somatopy.cli.options import Flags, Options, parse
from somatopy.cli.words import words_of
from somatopy.experiment import Description, DescriptionError, paper
from somatopy.learners.controls import Fixed
from somatopy.learners.hebbian import Hebbian
from somatopy.registry import INTERVENTIONS, LEARNERS


def options(*args: str, description: Description | None = None) -> Options:
    return parse(args, description or paper(), "somatopy test", "Test.")


def described(*args: str, description: Description | None = None) -> Description:
    return options(*args, description=description).description


def plastic(*parts: str) -> dict[str, object]:
    return {"kind": "plastic", "parts": parts}


OFFSET = INTERVENTIONS.dumped(INTERVENTIONS.validated("offset"))
ONE_PHASE = paper().replaced(phases=(paper().phases[0],))


def test_without_options_the_description_is_as_it_was() -> None:
    """Nothing said, nothing changed."""
    assert described() == paper()
    assert (options().out, options().json, options().flags.debug) == (None, False, False)


@pytest.mark.parametrize(
    ("args", "path", "value"),
    [
        (["--seed", "7"], "seed", 7),
        (["--eye", "geometric"], "eye.kind", "geometric"),
        (["--motion", "kinematic"], "body.motion", "kinematic"),
        (["--learner", "random"], "learner.kind", "random"),
        (["--minutes", "0.2", "--phases.1.frames", "96049"], "phases.0.frames", 117),
        (["--damage-minutes", "10"], "phases.1.frames", 9000),
        (["--damage", "none"], "phases.1.interventions", ()),
        (["--damage", "offset:0.1,-0.2,0,1e-1"], "phases.1.interventions.0.offset", (0.1, -0.2, 0.0, 0.1)),
        (["--body.head-speed", "2"], "body.head_speed", 2.0),
        (["--body.head_speed=2"], "body.head_speed", 2.0),
        (["--babbling.range", "confined"], "babbling.range", "confined"),
        (["--babbling.speed", "0.5"], "babbling.speed", 0.5),
        (["--learner.arm-map.shape", "10", "12"], "learner.arm_map.shape", (10, 12)),
        (["--learner.link-rate", "0.5"], "learner.link_rate", 0.5),
        (["--body.head-speed", "None"], "body.head_speed", None),
        (["--body.camera.fovy", "50"], "body.camera.fovy", 50.0),
        (["--body.marker.size=0.04"], "body.marker.size", 0.04),
        (["--eye.skip", "False"], "eye.skip", False),
        (["--eye.kind", "geometric"], "eye.kind", "geometric"),
        (["--eye.kind=geometric"], "eye.kind", "geometric"),
        (["--learner.kind", "random"], "learner.kind", "random"),
        (["--learner.arm-map.kind", "som"], "learner.arm_map.kind", "som"),
        (["--learner.head-map.kind", "som"], "learner.head_map.kind", "som"),
        (["--learner.head-map.periodic", "True"], "learner.head_map.periodic", True),
        (["--learner.rule.kind", "normalised"], "learner.rule.kind", "normalised"),
        (["--learner.units", "radian"], "learner.units", "radian"),
        (["--phases.0.frames", "5"], "phases.0.frames", 5),
        (["--phases.0.name", "first"], "phases.0.name", "first"),
        (["--phases.0.damage", "paper"], "phases.0.interventions", (OFFSET,)),
        (["--phases.0.damage.kind", "offset"], "phases.0.interventions", (OFFSET,)),
        (["--phases.0.plastic", "links", "arm_map"], "phases.0.interventions", (plastic("links", "arm_map"),)),
        (["--phases.0.plastic"], "phases.0.interventions", (plastic(),)),
        (["--phases.0.plastic=links"], "phases.0.interventions", (plastic("links"),)),
        (["--phases.1.start", "afresh"], "phases.1.interventions", ({"kind": "afresh"}, OFFSET)),
        (["--phases.1.start", "continue"], "phases.1.interventions", (OFFSET,)),
        (["--phases.1.damage.kind", "none"], "phases.1.interventions", ()),
        (["--phases.0.interventions.0.kind", "afresh"], "phases.0.interventions", ({"kind": "afresh"},)),
        (["--phases.1.interventions.1.kind", "shuffled"], "phases.1.interventions", (OFFSET, {"kind": "shuffled"})),
        (["--phases.1.interventions.0.offset", "1", "2", "3", "4"], "phases.1.interventions.0.offset", (1, 2, 3, 4)),
        (["--phases.1.trend-breaks", "3", "9"], "phases.1.trend_breaks", (3, 9)),
        (["--phases.1.damage.offset", "1", "-1", "0", "0"], "phases.1.interventions.0.offset", (1.0, -1.0, 0.0, 0.0)),
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
    """`--learner fixed` opens the fields of that control; choosing the type that is there keeps its fields."""
    assert described("--learner", "fixed", "--learner.head", "0.5", "0.1").learner == Fixed(head=(0.5, 0.1))
    file = paper().replaced(learner=Hebbian(link_rate=0.5))
    assert described("--learner", "hebbian", description=file).learner == Hebbian(link_rate=0.5)
    file = paper().replaced(learner={"kind": "random"})
    assert described("--learner", "hebbian", description=file).learner == Hebbian()


def test_damage_by_name() -> None:
    """`paper` is the paper's shift, whatever the file says."""
    file = described("--damage", "offset:1,1,1,1")
    assert done(described("--damage", "paper", description=file), 1) == [OFFSET]


def done(description: Description, phase: int) -> list[dict[str, object]]:
    """What is done in a phase, as tables."""
    return [INTERVENTIONS.dumped(settings) for settings in description.phases[phase].interventions]


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
        assert (added[1].frames, added[1].damage) == (frames, kind)


def test_kinds_are_chosen_before_their_fields_are_set() -> None:
    """At any depth, in whatever order the options stand; another kind begins with its own defaults."""
    words = ["--learner.arm-map.shape", "7", "--learner.arm-map.kind", "som", "--learner.kind", "hebbian"]
    file = paper().replaced(learner="random")
    for args in (words, [*words[2:], *words[:2]]):
        arm_map = described(*args, description=file).learner.arm_map
        assert (arm_map.kind, arm_map.shape) == ("som", (7,))
    same = described("--learner.arm-map.kind", "dsom", "--learner.arm-map.shape", "7", "7").learner
    assert same == paper().learner.replaced(arm_map=paper().learner.arm_map.replaced(shape=(7, 7)))


def test_a_damage_is_chosen_and_then_set() -> None:
    """The kind that is there keeps its settings when it is named again, and any other order says the same."""
    file = described("--damage", "offset:1,1,1,1")
    assert described("--phases.1.damage.kind", "offset", description=file) == file
    kind, offset = ["--phases.0.damage.kind", "offset"], ["--phases.0.damage.offset", "0.1", "0", "0", "0"]
    for args in ([*kind, *offset], [*offset, *kind]):
        assert done(described(*args), 0) == [{"kind": "offset", "offset": (0.1, 0.0, 0.0, 0.0)}]


def test_short_forms_replace_what_they_stand_for_and_keep_the_rest() -> None:
    """`none` and `continue` take it away; what else is done stays in its place. Numbers count the short forms too."""
    more = ["--phases.1.interventions.3.kind", "offset", "--phases.1.plastic", "links", "--phases.1.start", "afresh"]
    file = described(*more)
    kinds = ["afresh", "plastic", "offset", "offset"]
    assert [entry["kind"] for entry in done(file, 1)] == kinds
    for args, left in (
        (["--damage", "none"], ["afresh", "plastic"]),
        (["--damage", "paper"], ["afresh", "plastic", "offset"]),
        (["--phases.1.start", "continue"], ["plastic", "offset", "offset"]),
        (["--phases.1.start", "shuffled"], ["shuffled", "plastic", "offset", "offset"]),
        (["--phases.1.plastic"], kinds),
        (["--phases.1.interventions.3.kind", "shuffled"], ["afresh", "plastic", "offset", "shuffled"]),
    ):
        assert [entry["kind"] for entry in done(described(*args, description=file), 1)] == left
    with pytest.raises(
        DescriptionError, match=r"asks for one damage in phases.1, which has 2; .*interventions.K.offset"
    ):
        described("--phases.1.damage.offset", "1", "1", "1", "1", description=file)


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
        (["--learner.eta", "1"], ["--learner.kind", "--learner.link-rate", "--learner.arm-map.*", "--learner.rule.*"]),
        (["--learner", "fixed", "--learner.arm-map.shape", "3", "3"], ["--learner.kind", "--learner.head"]),
        (["--learner.arm-map.kynd", "som"], ["--learner.arm-map.kind", "--learner.arm-map.shape"]),
        (["--phases.7.frames", "1"], ["--phases.0.*", "--phases.1.*"]),
        (["--phases.7.damage", "none"], ["--phases.0.*", "--phases.1.*"]),
        (["--phases.1.damge.offset", "1"], ["--phases.1.frames", "--phases.1.damage", "--phases.1.damage.*"]),
        (["--phases.0.interventions.1.kind", "afresh"], ["--phases.0.frames", "--phases.0.start"]),
        (["--minuts", "1"], ["--minutes", "--damage-minutes", "--seed", "--learner.*", "--body.*"]),
        (["--minuts=1"], ["--minutes", "--json"]),
    ],
)
def test_an_unknown_option_lists_the_valid_ones_near_it(args: list[str], valid: list[str]) -> None:
    """The innermost table it shares with valid keys, else all; the option is named."""
    with pytest.raises(DescriptionError) as caught:
        options(*args)
    message = str(caught.value)
    unknown = [arg for arg in args if arg.startswith("--")][-1].partition("=")[0]
    assert message.startswith(f"Unknown option {unknown}. ") and len(message) < 600
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
        (["--phases.1.damage.offset", "1", "nan"], r"phases.1.damage.offset.1 = nan: .*finite"),
        (["--phases.1.interventions.0.offset", "1", "nan"], r"phases.1.interventions.0.offset.1 = nan: .*finite"),
        (["--phases.1.damage.kind", "rust"], r"phases.1.damage.kind = 'rust' is unknown; choose one of offset"),
        (["--phases.0.damage", "rust"], "--phases.0.damage 'rust' is unknown; choose none, paper or offset:a,b,c,d"),
        (
            ["--phases.0.start", "again"],
            "--phases.0.start 'again' is unknown; choose one of continue, afresh, shuffled",
        ),
        (["--phases.0.start"], "--phases.0.start takes one value, not 0"),
        (["--phases.0.damage", "none", "paper"], "--phases.0.damage takes one value, not 2"),
        (["--learner", "clever"], "learner.kind = 'clever' is unknown; choose one of hebbian, .*my_file:MyLearner"),
        (["--learner.kind", "clever"], "learner.kind = 'clever' is unknown"),
        (["--learner.arm-map.kind", "sam"], "learner.arm_map.kind = 'sam' is unknown; choose one of dsom"),
        (["--eye", "third"], "eye.kind = 'third' is unknown; choose one of fiducial, geometric"),
        (["--motion", "fast"], "body.motion = 'fast': .*'dynamic' or 'kinematic'"),
        (["--babbling.speed", "-1"], "babbling.speed = -1.0: .*greater than 0"),
        (["--learner.link-rate", "0"], "learner.link_rate = 0.0: .*greater than 0"),
        (["--phases.0.frames", "-1"], "phases.0.frames = -1: .*greater than or equal to 0"),
        (["--phases.1.trend-breaks", "7", "3"], "phases.1.trend_breaks: .*increasing"),
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
    ("args", "takes"),
    [
        (["--minutes", "soon"], "takes a number of minutes"),
        (["--minutes"], "needs a number of minutes behind it"),
        (["--seed", "1.5"], "takes a whole number"),
        (["--learner.units", "radians"], "takes one of unit, radian. Did you mean radian?"),
        (["--learner.kind"], "needs KIND"),
        (["--learner.arm-map.shape", "3.5"], "takes whole numbers"),
        (["--learner.arm-map.elasticity", "stiff"], "takes a number, or None"),
        (["--eye.skip", "maybe"], "takes True or False"),
        (["--phases.1.trend-breaks", "soon"], "takes whole numbers"),
        (["--seed", "1", "2"], "takes a whole number"),
    ],
)
def test_a_value_that_does_not_parse_is_told_in_a_sentence(
    args: list[str], takes: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """The option, the value and what it takes; the library that parses says nothing itself."""
    with pytest.raises(DescriptionError) as caught:
        options(*args)
    message = str(caught.value)
    assert message.startswith(" ".join(args)) and takes in message and "\n" not in message
    assert capfd.readouterr() == ("", "")


def test_minutes_alone_are_those_of_all_phases_in_proportion() -> None:
    """Whatever they are, frames add up and phases keep their shares; with --damage-minutes they are the first's."""
    whole = paper().frames
    for minutes in (0.01, 1, 7.3, 60):
        phases = described("--minutes", str(minutes)).phases
        assert sum(phase.frames for phase in phases) == round(900 * minutes)
        for phase, before in zip(phases, paper().phases, strict=True):
            assert abs(phase.frames - 900 * minutes * before.frames / whole) <= 1
    both = described("--minutes", "2", "--damage-minutes", "3").phases
    assert [phase.frames for phase in both] == [1800, 2700]
    assert [phase.frames for phase in described("--minutes", "1", description=ONE_PHASE).phases] == [900]


def help_of(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    """What help prints, which must be all that is printed."""
    with pytest.raises(SystemExit) as caught:
        options(*args)
    assert caught.value.code == 0
    out, err = capsys.readouterr()
    assert err == ""
    return out


def test_help_shows_text_and_flags_and_names_tables(capsys: pytest.CaptureFixture[str]) -> None:
    """Wherever --help stands; dotted options are shown of the table that is asked for, with what is chosen."""
    for args in (["--help"], ["-h"], ["--learner", "fixed", "--help"], ["--help", "--learner", "fixed"]):
        out = help_of(capsys, *args)
        for word in ("Test.", "--seed", "--damage-minutes", "--json", "body, eye, babbling, learner, phases"):
            assert word in out
        assert "--learner.kind" not in out
    phases = help_of(capsys, "--help", "phases")
    for word in ("--phases.0.start", "--phases.0.plastic", "--phases.0.damage ", "--phases.1.damage.kind"):
        assert word in phases
    assert "--phases.1.damage.offset" in phases and "--seed" not in phases
    for args in (["--learner", "fixed", "--help", "learner"], ["-h", "learner", "--learner", "fixed"]):
        fixed = help_of(capsys, *args)
        assert "--learner.head " in fixed and "--learner.arm-map" not in fixed
    assert "--learner.arm-map.shape" in help_of(capsys, "--help", "learner.arm-map")


@pytest.mark.parametrize("value", [True, False])
def test_a_dotted_truth_value_is_written_out(value: bool) -> None:
    """Like every other field, and without changing what --json means."""
    options = parse(["--eye.skip", str(value), "--json"], paper(), "program", "text")
    assert options.description.eye.skip is value and options.json


@pytest.mark.parametrize("width", [80, 120])
def test_help_fits_the_terminal_and_is_written_for_readers(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No formula of a docstring, no word of the parser's own, every option with its meaning; kinds are named."""
    monkeypatch.setenv("COLUMNS", str(width))
    short, *tables = (help_of(capsys, "--help", *table) for table in ([], ["body"], ["eye"], ["learner"], ["phases"]))
    assert len(short.splitlines()) <= 40
    out = "\n".join([short, *tables])
    assert max(map(len, out.splitlines())) <= width
    for word in ("{None}", "STR", "default: None", "\\", "`", ":math:", "varepsilon", "[["):
        assert word not in out, word
    for kinds in (LEARNERS, INTERVENTIONS):
        assert all(kind in out for kind in kinds)
    said = [word.text for word in words_of(mirrored(paper(), as_help=True))] + [word.text for word in words_of(Flags)]
    assert all(text.endswith((".", ")")) for text in said), said


def test_help_numbers_interventions_by_their_place(capsys: pytest.CaptureFixture[str]) -> None:
    """Of two damages each has its own options, although what begins the phase stands before them."""
    more = ["--phases.1.interventions.2.kind", "offset", "--phases.1.start", "afresh"]
    out = " ".join(help_of(capsys, *more, "--help", "phases.1").split())
    for word in ("--phases.1.interventions.1.offset", "--phases.1.interventions.2.offset", "(default: afresh)"):
        assert word in out
    assert "interventions.0" not in out and "--phases.1.damage.offset" not in out
