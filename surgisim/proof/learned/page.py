"""The numbers as a page of tables."""

from typing import Any

BETTER = 0.2
"""Share by which forward-backward error must be lower to be called better."""


def verdict(clips: dict[str, Any]) -> dict[str, Any]:
    """What the tables say: the least gain over all clips and spans, and where each is the better one."""
    gains = {
        name: {
            span: 1 - raft["back_mean"] / told["flow"][by][span]["back_mean"]
            for span, raft in told["flow"]["raft"].items()
        }
        for name, told in clips.items()
        if "flow" in told
        for by in ["dis_flat_light"]
    }
    tracked = {
        name: {
            span: 1 - both["raft"]["back_mean"] / both["dis"]["back_mean"] for span, both in told["followed"].items()
        }
        for name, told in clips.items()
        if "followed" in told
    }
    every = [gain for part in (gains, tracked) for spans in part.values() for gain in spans.values()]
    return {
        "raft_gain_of_flow": {n: {s: round(g, 3) for s, g in spans.items()} for n, spans in gains.items()},
        "raft_gain_of_tracks": {n: {s: round(g, 3) for s, g in spans.items()} for n, spans in tracked.items()},
        "raft_is_better": bool(every) and min(every) >= BETTER,
    }


def tables(clips: dict[str, Any]) -> str:
    """Markdown."""
    return "\n".join([*_masks(clips), "", *_flow(clips), "", *_followed(clips)]) + "\n"


def _masks(clips) -> list[str]:
    lines = [
        "| clip | masks by | overlap, mean (least) | inside the given | widened by | overlap then | s a frame |",
        "|---|---|---|---|---|---|---|",
    ]
    for clip, told in clips.items():
        for name in ("colour_motion", "sam2"):
            row = told.get("masks", {}).get(name)
            if not row:
                continue
            cells = ["", "", "", ""]
            if "overlap" in row:
                cells = [
                    _pair(row["overlap"]),
                    f"{row['inside_given']['mean']:.3f}",
                    f"{row['widened_by']} px",
                    _pair(row["overlap_widened"]),
                ]
            lines.append(f"| {clip} | {name} | {' | '.join(cells)} | {row['seconds_a_frame']:.2f} |")
    return lines


def _pair(values: dict[str, float]) -> str:
    return f"{values['mean']:.3f} ({values['min']:.3f}, frame {values['at']})"


def _flow(clips) -> list[str]:
    lines = [
        "| clip | frames | flow | back, mean [px] | median [px] | > 1 px [%] | alike | rows [px] | columns [px] | s |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for clip, told in clips.items():
        spans = next(iter(told.get("flow", {}).values()), {})
        for span in spans:
            for name, by in told["flow"].items():
                row = by[span]
                views = [f"{row[k]:.3f}" if k in row else "" for k in ("views_rows", "views_columns")]
                lines.append(
                    f"| {clip} | {span} | {name} | {row['back_mean']:.3f} | {row['back_median']:.3f} | "
                    f"{100 * row['back_over_1px']:.1f} | {row['alike']:.3f} | {' | '.join(views)} | "
                    f"{row['seconds']:.2f} |"
                )
    return lines


def _followed(clips) -> list[str]:
    lines = [
        "| clip | frames | followed by | back, mean [px] | median [px] | seen both ways [%] | s a frame |",
        "|---|---|---|---|---|---|---|",
    ]
    for clip, told in clips.items():
        for span, by in told.get("followed", {}).items():
            for name, row in by.items():
                words = "dis" if name == "dis" else "dis, and raft from frame 0"
                lines.append(
                    f"| {clip} | {span} | {words} | {row['back_mean']:.3f} | {row['back_median']:.3f} | "
                    f"{100 * row['seen_both_ways']:.1f} | {row['seconds_a_frame']:.2f} |"
                )
    return lines
