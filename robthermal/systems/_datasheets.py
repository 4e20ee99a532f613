"""Rated values of thermoelectric modules, collected from sheets, shop pages and papers."""

from __future__ import annotations

from importlib.resources import files

from .._pandas import pd


def datasheets() -> pd.DataFrame:
    """Rated values of thermoelectric modules, one row per module and hot-side temperature.

    Most rows were read in secondary sources: check the vendor's own sheet before relying on one. The column ``caveat``
    says what is known to be odd about a row. Pass a row to `robthermal.thermal.module_from_datasheet` (see example).

    Returns
    -------
    DataFrame
        Index: name. Columns: couples, Th_C [°C], Vmax_V [V], Imax_A [A], Qmax_W [W], dTmax_K [K], R_ac_ohm [Ω],
        size_mm, source, caveat. Values a source does not give are missing.

    Examples
    --------
    >>> import robthermal as rt
    >>> row = rt.systems.datasheets().loc["TM 127-1.4-4.0"]
    >>> fit = rt.thermal.module_from_datasheet(v_max=row.Vmax_V, i_max=row.Imax_A, dt_max=row.dTmax_K,
    ...                                        q_max=row.Qmax_W, t_hot=row.Th_C + 273.15)
    >>> print(f"{fit.q_max_misfit:+.1%}")  # this sheet contradicts itself
    +16.5%
    """
    with files(__package__).joinpath("datasheets.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file, index_col="name", dtype={"couples": "Int64", "size_mm": "string"})
