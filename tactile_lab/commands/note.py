"""``tactile-lab note``: what people say of a run, so that it is found again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import print_json, refusing, say


@click.command()
@run_argument
@click.argument("text", required=False)
@click.option("--at", metavar="TIME", help='On the run\'s axis, such as "12.5 s".')
@click.option("--tag", multiple=True, metavar="WORD", help="Add a tag; repeatable.")
@click.option("--untag", multiple=True, metavar="WORD", help="Take a tag away.")
@click.option("--star/--no-star", default=None, help="Give it a star, or take it away.")
@click.option("--title", metavar="TEXT", help="Call it so; empty for its own title.")
@json_option
def command(
    run: Path,
    text: str | None,
    at: str | None,
    tag: tuple[str, ...],
    untag: tuple[str, ...],
    star: bool | None,
    title: str | None,
    as_json: bool,
) -> None:
    """Add the note TEXT, tags or a star to RUN; without any, say what it has.

    The record itself is never touched. `runs --where 'tag = cal'`, `note ~ magnet` and
    `starred = yes` find the run again.
    """
    with refusing():
        from tactile_lab.errors import SceneError
        from tactile_lab.quantity import parse
        from tactile_lab.store.folder import read_info
        from tactile_lab.store.remarks import (
            Note,
            Remarks,
            change_remarks,
            read_remarks,
        )

        read_info(run)  # a run, and no other folder
        if at is not None and not text:
            raise SceneError("--at says when a note is of; write the note after RUN.")
        note = None
        if text is not None:
            if not text.strip():
                raise SceneError("The note is empty.")
            note = Note(text=text, time=None if at is None else parse(at, "s"))
        added, gone = tuple(map(_word, tag)), {_word(one) for one in untag}

        def change(said: Remarks) -> Remarks:
            for word in sorted(gone - {*said.tags}):
                raise SceneError(
                    f"{run.resolve().name} has no tag {word}; it has "
                    f"{', '.join(said.tags) or 'none'}."
                )
            tags = dict.fromkeys((*said.tags, *added))
            return replace(
                said,
                notes=said.notes if note is None else (*said.notes, note),
                tags=tuple(one for one in tags if one not in gone),
                starred=said.starred if star is None else star,
                title=said.title if title is None else title.strip(),
            )

        asked = (note, star, title) != (None, None, None) or tag or untag
        found = change_remarks(run, change) if asked else read_remarks(run)
    if as_json:
        notes = [{"text": n.text, "time_s": n.time, "at": n.at} for n in found.notes]
        print_json(
            {
                "title": found.title,
                "tags": list(found.tags),
                "starred": found.starred,
                "notes": notes,
            }
        )
        return
    mark = "* " if found.starred else ""
    say(
        " ".join(
            (
                f"{mark}{found.title or run.resolve().name}",
                *(f"#{t}" for t in found.tags),
            )
        )
    )
    for one in found.notes:
        say(f"  {one}")


def _word(text: str) -> str:
    """A tag as it is kept."""
    from tactile_lab.errors import SceneError

    word = text.strip().removeprefix("#")
    if not word or "," in word or word.split() != [word]:
        raise SceneError(f'"{text}" is no tag; write one word, such as cal.')
    return word
