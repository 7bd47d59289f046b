"""One page of a case: its controls, its picture, and a thread that answers its newest question."""

from __future__ import annotations

import html
import math
import threading
import time
from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np

from coverable.errors import CoverableError
from feasibility.cases.case import Case, Setup
from feasibility.live.answers import Answer, Superseded, Watch, certified, quick_look, steps_of
from feasibility.live.arm import NOT_DRAWN, Arm
from feasibility.live.controls import LIMITS, STEP, SURFACE, TASK, Controls, Values
from feasibility.live.drawing import Scene
from feasibility.live.handle import Handle
from feasibility.live.workbench import Workbench
from feasibility.viewer.html_page import Entry
from feasibility.viewer.threejs import hex_colour
from feasibility.viewer.verdict_scene import Layer
from feasibility.viewer.viewer import View

STILL = 0.25  # [s] without a change, after which the certified answer is looked for
FRAME = 1.0 / 25.0  # [s] of a motion that is played
SAID = 1.0  # [s] between two words about how far a search is
MOST_UNDONE = 200
BUG = "this is a bug in coverable: {}: {}; the page goes on working"
COLOURS = {"feasible": "#0f6537", "infeasible": "#a11116", "undecided": "#8a4b08",
           "quick": "#38506b", "error": "#59328a"}  # fmt: skip
HEAD = (
    '<div style="margin:0 1em;border-left:6px solid {colour};padding-left:.6em">'
    '<b class="{kind}" style="color:{colour}">{head}</b><br>{state}</div>'
)
SWATCH = (
    '<div style="font-size:85%"><span style="display:inline-block;width:.8em;height:.8em;'
    'margin:0 .5em 0 1em;background:#{:06x}"></span>{}</div>'
)


class Page:
    """What one browser window shows of a case."""

    def __init__(self, client: Any, controls: Controls, bench: Workbench, first: View) -> None:
        """Draw the case as it was given, and begin to answer.

        Args:
            client: the window, of viser.
            controls: what can be changed.
            bench: builds the changed cases.
            first: the case before anything is known of it.
        """
        self.client, self.controls, self.bench = client, controls, bench
        self.values: Values = dict(controls.values)
        self.before, self.after = list[Values](), list[Values]()
        self.answer: Answer | None = None
        self.number, self.answered, self.closed = 1, 0, False
        self._held = False  # the next change belongs to the one before it
        self._said_at = 0.0
        self._switches = list[Any]()  # of the answer's parts
        self.changed = threading.Condition()
        self.scene = Scene(client.scene)
        self.arm = Arm(client, self.scene, first, bench.setup, controls.case)
        self._panel(first)
        self.handle = Handle(client, self.arm, controls, bench.setup, self.set)
        self.handle.place(self.values)
        for work in (self._work, self._play):
            threading.Thread(target=work, daemon=True, name="coverable-live").start()

    # -- controls --------------------------------------------------------------------------------

    def _panel(self, first: View) -> None:
        """The sliders and texts of the page."""
        gui = self.client.gui
        self.head, self.sliders = gui.add_html(""), dict[tuple[str, str], Any]()
        buttons = gui.add_button_group("", ("undo", "redo", "reset", "save as case"))
        buttons.on_click(lambda event: self.press(event.target.value))
        for name, keys in (("undo", "cmd/ctrl"), ("redo", "cmd/ctrl+shift")):
            command = gui.add_command(name, hotkey="Z", modifier=keys)
            command.on_trigger(lambda event, name=name: self.press(name))
        folders = dict[str, Any]()
        for group, name, unit, low, high in self.controls.dials:
            if group not in folders:
                folders[group] = gui.add_folder(group, expand_by_default=group in (SURFACE, TASK))
            with folders[group]:
                add = gui.add_multi_slider if group == LIMITS else gui.add_slider
                start = self.values[group, name]
                slider = add(f"{name} ({unit})", low, high, STEP, initial_value=start)
            slider.on_update(lambda event, dial=(group, name): self._slid(event, dial))
            self.sliders[group, name] = slider
        self.arm.add_jog()
        with gui.add_folder("evidence"):
            self.evidence = gui.add_html("")
            self.playing = gui.add_checkbox("play", False, visible=False)
            self.time = gui.add_slider("time (s)", 0.0, 1.0, 0.01, 0.0, visible=False)
            self.time.on_update(lambda event: self._seek(event.target.value))
        with gui.add_folder("legend"):
            self.colours = gui.add_html("")
        self.parts = gui.add_folder("parts of the picture", expand_by_default=False)
        self._standing = [
            one
            for one in first.legend.entries
            if one.path is not None and not any(part in one.path for part in NOT_DRAWN)
        ]
        for entry in self._standing:
            self._switch(entry)

    def _slid(self, event: Any, dial: tuple[str, str]) -> None:
        """A slider was moved by hand: the page moves them too."""
        if event.client_id is not None:
            self.change({dial: event.target.value})

    def set(self, values: Values) -> None:
        """Change some values, and move their sliders too."""
        self.change(values)
        for dial, value in values.items():
            self.sliders[dial].value = value

    def change(self, values: Values, remember: bool = True) -> None:
        """Ask anew with some values changed; what comes within a moment is one change."""
        with self.changed:
            if remember and not self._held:
                self.before, self.after = [*self.before[-MOST_UNDONE:], self.values], []
            self._held, self.values = remember, {**self.values, **values}
            self.number += 1
            self._place()
            self.changed.notify_all()

    def press(self, button: str) -> None:
        """Undo, redo, reset, or save as case."""
        if button == "save as case":
            self._save()
            return
        with self.changed:
            here, there = (
                (self.before, self.after) if button == "undo" else (self.after, self.before)
            )
            if button == "reset":
                self._held = False
                values = self.controls.values
            elif not here:
                return
            else:
                values = here.pop()
                there.append(self.values)
            self.change(values, remember=button == "reset")
            self._held = False
            for dial, slider in self.sliders.items():
                slider.value = values[dial]

    def _save(self) -> None:
        """Let the browser download what is shown as a case file."""
        try:
            case = self.controls.changed(self.values)
        except CoverableError as error:
            self._say("error", str(error))
            return
        name = self.controls.case.name
        text, of = case.as_written(), f"# As `coverable live` showed {name}"
        if case.source is not None and not text.startswith(of):
            text = f"{of}; its paths are relative to the folder of that file.\n{text}"
        stem = name.rpartition("/")[2] if name.endswith(".toml") else name
        plain = "".join(c if c.isalnum() or c in "._" else "-" for c in stem.removesuffix(".toml"))
        self.client.send_file_download(f"{plain}-live.toml", text.encode(), save_immediately=True)

    # -- answers ---------------------------------------------------------------------------------

    def _work(self) -> None:
        """Until the page is closed: a quick look at each change, and the certified answer."""
        final = True
        while not self.closed:
            with self.changed:
                number, values = self.number, self.values
            answer = self._look(number, values, final)
            with self.changed:
                if answer is not None and not self.closed:
                    self._show(answer, values)
                    self.answered = number
                newer = self.changed.wait_for(
                    partial(self._outdated, number), None if final else STILL
                )
                self._held, final = self._held and newer, not newer

    def _outdated(self, number: int) -> bool:
        """Has something changed since, or is the page closed?"""
        return self.number != number or self.closed

    def _look(self, number: int, values: Values, final: bool) -> Answer | None:
        """The answer to one question; bad values and faults of ours are answers, too.

        None where nobody waits for it any more: quick looks are short, and are shown even so.
        """

        def wanted() -> bool:
            return not (self._outdated(number) if final else self.closed)

        try:
            case = self.controls.changed(values)
            setup = self.bench.build(case, roughly=not final)
            self._stand(case, setup)
            if final:
                return certified(case, setup, Watch(wanted, self._wait, setup.search.time_limit))
            return quick_look(setup, Watch(wanted, self._wait, steps=steps_of(setup)))
        except CoverableError as error:
            return Answer("error", str(error))
        except Superseded:
            return None
        except Exception as error:  # noqa: BLE001 - the page goes on working
            return Answer("error", BUG.format(type(error).__name__, error))

    def _wait(self, said: str) -> None:
        """It takes longer: say how far it is."""
        if time.monotonic() - self._said_at > SAID:
            self._say("quick", "still deciding ...", said)

    def _say(self, kind: str, head: str, state: str = "") -> None:
        self._said_at = time.monotonic()
        self.head.content = HEAD.format(
            colour=COLOURS[kind], kind=kind, head=html.escape(head), state=html.escape(state)
        )

    def _show(self, answer: Answer, values: Values) -> None:
        """Show an answer in place of the last one."""
        self._say(answer.kind, answer.head, answer.state)
        if self.answer is not None:
            self.scene.clear(self.arm.path(part.entry) for part in self.answer.parts)
        for switch in self._switches:
            switch.remove()
        self._switches, self.answer = [], answer
        if answer.kind != "error":
            self.scene.clear([self.arm.group + "/cells"])
            with self.client.atomic():
                self._draw((*answer.paint, *answer.parts))
                self.arm.pose(answer.q)
            self.handle.painted(values)
            self._place()
        self._switches += [self._switch(part.entry) for part in answer.parts]
        shown = (*(part.entry for part in (*answer.paint, *answer.parts)), *self._standing)
        self.colours.content = "".join(
            SWATCH.format(hex_colour(one.colour), html.escape(one.label)) for one in shown
        )
        rows = "".join(f"<tr><th>{n}</th><td>{html.escape(t)}</td></tr>" for n, t in answer.rows)
        causes = html.escape("\n".join(("Not covered:", *answer.causes) if answer.causes else ()))
        self.evidence.content = (
            f'<div style="font-size:85%;margin:0 1em"><table>{rows}</table>'
            f'<pre style="white-space:pre-wrap">{causes}</pre></div>'
        )
        self._player(answer)

    def _player(self, answer: Answer) -> None:
        """Controls of the motion, where there is one."""
        self.playing.visible = self.time.visible = answer.motion is not None
        if answer.motion is None:
            self.playing.value = False
        else:
            self.time.max = round(float(answer.motion.seconds[-1]), 2)
            self.time.value = 0.0

    # -- the picture -----------------------------------------------------------------------------

    def _stand(self, case: Case, setup: Setup) -> None:
        """Show arm, tool and scene where this case has them."""
        with self.client.atomic():
            self.arm.stand(case, setup)

    def _draw(self, parts: Iterable[Layer]) -> None:
        """Draw parts in the frame of the surface's link."""
        commands = [command for part in parts for command in part.commands]
        self.scene.run(self.arm.grouped(commands))

    def _place(self) -> None:
        """Move the drawn surface, its cells and the handle to where the values say."""
        surface, cells = self.handle.place(self.values)
        self.scene.place(self.arm.group + "/surface", surface)
        self.scene.place(self.arm.group + "/cells", cells)

    def _switch(self, entry: Entry) -> Any:
        """A box that shows and hides a part."""
        path = self.arm.path(entry)
        with self.parts:
            box = self.client.gui.add_checkbox(entry.label, entry.shown)
        box.on_update(lambda event: self.scene.show(path, event.target.value))
        return box

    # -- the motion ------------------------------------------------------------------------------

    def _play(self) -> None:
        """Move the arm while the box is ticked."""
        while not self.closed:
            time.sleep(FRAME)
            motion = None if self.answer is None else self.answer.motion
            if motion is not None and self.playing.value:
                self.time.value = math.fmod(self.time.value + FRAME, float(motion.seconds[-1]))

    def _seek(self, seconds: float) -> None:
        """Show the arm at a moment of the motion."""
        motion = None if self.answer is None else self.answer.motion
        if motion is not None:
            self.arm.pose(motion.at(np.array([seconds]))[0])

    def close(self) -> None:
        """The window is gone."""
        with self.changed:
            self.closed = True
            self.changed.notify_all()
