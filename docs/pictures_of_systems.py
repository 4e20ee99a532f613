"""Draws docs/images/two_module.svg, the network of the demo machine; run after a change of `System.plot`."""

from pathlib import Path

import robthermal as rt


def picture() -> str:
    """The network of the two-module set-up, as SVG."""
    with rt.report.house_style():
        drawn = rt.systems.two_module().plot().figure
    return rt.report.Figure.draw(drawn, alt="Network of the two-module set-up.", caption="Two-module set-up.").svg


if __name__ == "__main__":
    Path(__file__).with_name("images").joinpath("two_module.svg").write_text(picture() + "\n", encoding="utf-8")
