"""Draw the paper's model as vector art, docs/img/model.svg: two maps, the links between them, body and eye.

python docs/make_model_picture.py
"""

from __future__ import annotations

from pathlib import Path

INK, SOFT, ARM, HEAD, LINK = "#22303c", "#8a97a3", "#2f6db5", "#c8553d", "#3a8f5c"
FONT = "font-family='Helvetica, Arial, sans-serif'"
UNITS, STEP, RADIUS = 7, 22, 5.5
ARM_AT, HEAD_AT, TOP = 196, 532, 96
WINNER_ARM, WINNER_HEAD = (4, 2), (2, 3)


def text(x: float, y: float, words: str, size: int = 14, colour: str = INK, weight: str = "normal") -> str:
    return (
        f"<text x='{x}' y='{y}' font-size='{size}' fill='{colour}' font-weight='{weight}' text-anchor='middle' {FONT}>"
        f"{words}</text>"
    )


def place(left: float, unit: tuple[int, int]) -> tuple[float, float]:
    return left + unit[0] * STEP, TOP + unit[1] * STEP


def lattice(left: float, winner: tuple[int, int], colour: str) -> list[str]:
    """A square lattice; units are the fuller, the nearer they are to the winner."""
    end = (UNITS - 1) * STEP
    lines = [
        f"<path d='M{left} {TOP + k * STEP}h{end}M{left + k * STEP} {TOP}v{end}' stroke='{SOFT}' stroke-width='1'/>"
        for k in range(UNITS)
    ]
    circles = []
    for column in range(UNITS):
        for row in range(UNITS):
            x, y = place(left, (column, row))
            apart = (column - winner[0]) ** 2 + (row - winner[1]) ** 2
            full = max(0.0, 1.0 - apart / 6.0)
            circles.append(
                f"<circle cx='{x}' cy='{y}' r='{RADIUS + 2 * (apart == 0)}' fill='white' stroke='{colour}'/>"
                f"<circle cx='{x}' cy='{y}' r='{RADIUS + 2 * (apart == 0)}' fill='{colour}' fill-opacity='{full:.2f}'/>"
            )
    return lines + circles


def links() -> list[str]:
    """Links from the units around the arm map's winner to those around the head map's, the strongest the widest."""
    around = [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)]
    drawn = []
    for a in around:
        for h in around:
            x0, y0 = place(ARM_AT, (WINNER_ARM[0] + a[0], WINNER_ARM[1] + a[1]))
            x1, y1 = place(HEAD_AT, (WINNER_HEAD[0] + h[0], WINNER_HEAD[1] + h[1]))
            best = a == h == (0, 0)
            drawn.append(
                f"<path d='M{x0} {y0}C{x0 + 90} {y0} {x1 - 90} {y1} {x1} {y1}' fill='none' stroke='{LINK}' "
                f"stroke-width='{3.2 if best else 0.8}' stroke-opacity='{1.0 if best else 0.35}'/>"
            )
    return drawn


def box(x: float, y: float, width: float, lines: list[str], colour: str) -> str:
    height = 20 * len(lines) + 16
    words = "".join(text(x + width / 2, y + 24 + 20 * k, line, 14) for k, line in enumerate(lines))
    return (
        f"<rect x='{x}' y='{y}' width='{width}' height='{height}' rx='8' fill='white' stroke='{colour}' "
        f"stroke-width='2'/>{words}"
    )


def arrow(path: str, colour: str = INK) -> str:
    return f"<path d='{path}' fill='none' stroke='{colour}' stroke-width='2' marker-end='url(#tip)'/>"


def picture() -> str:
    bottom = TOP + (UNITS - 1) * STEP
    middle_arm, middle_head = ARM_AT + 3 * STEP, HEAD_AT + 3 * STEP
    parts = [
        f"<rect width='860' height='420' fill='white'/><defs><marker id='tip' viewBox='0 0 10 10' refX='9' refY='5' "
        f"markerWidth='7' markerHeight='7' orient='auto-start-reverse'>"
        f"<path d='M0 0L10 5L0 10z' fill='{INK}'/></marker></defs>",
        text(middle_arm, 40, "arm map", 18, ARM, "bold"),
        text(middle_arm, 62, "each unit stands for a posture of the arm", 13, SOFT),
        text(middle_head, 40, "head map", 18, HEAD, "bold"),
        text(middle_head, 62, "each unit stands for a posture of the head", 13, SOFT),
        *lattice(ARM_AT, WINNER_ARM, ARM),
        *lattice(HEAD_AT, WINNER_HEAD, HEAD),
        *links(),
        text(430, 116, "Hebbian links", 16, LINK, "bold"),
        text(430, 246, "grow while the hand is seen", 13, SOFT),
        box(10, 300, 194, ["babbling moves the arm", "to random postures"], ARM),
        box(344, 300, 172, ["the eye looks", "for the hand"], LINK),
        box(668, 300, 170, ["the head turns to", "the chosen posture"], HEAD),
        arrow(f"M107 298V{TOP + 2 * STEP}H{ARM_AT - 16}"),
        text(107, 124, "sensed arm", 13, SOFT),
        arrow(f"M{HEAD_AT + (UNITS - 1) * STEP + 14} {TOP + 3 * STEP}H753V298"),
        text(753, 146, "most strongly linked", 13, SOFT),
        arrow("M666 328H518"),
        arrow("M206 328H342"),
        arrow(f"M430 298V{260}", LINK),
        arrow(f"M668 312L{middle_head + 10} {bottom + 14}"),
        text(592, 288, "sensed head", 13, SOFT),
        text(430, 402, "fifteen times a second, and it never stops learning", 14, INK),
    ]
    return "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 860 420' role='img'>" + "\n".join(parts) + "</svg>\n"


if __name__ == "__main__":
    target = Path(__file__).parent / "img" / "model.svg"
    target.write_text(picture(), encoding="utf-8")
    print(target)
