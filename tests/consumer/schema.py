"""Validates specs against the JSON Schema: every good spec passes, every bad one fails that a schema can detect.

Usage: schema.py SCHEMA SPEC..., the output of `slipsweep schema`, and good specs in addition to those in sweeps/.
"""

import json
import sys
import tomllib
from pathlib import Path

import jsonschema

REPOSITORY = Path(__file__).resolve().parents[2]

# What takes a file, two keys or an expression to see; each of these has to pass, or it is no exception.
ONLY_THE_CHECK = {
    "axes_missing",
    "axis_missing",
    "block_and_axes",
    "block_and_where",
    "block_axis_missing",
    "block_empty",
    "block_points",
    "block_units",
    "block_where",
    "coefficients_missing",
    "expr_cycle",
    "expr_literal_too_large",
    "expr_not_a_number",
    "expr_of_itself",
    "expr_out_of_range",
    "expr_power_twice",
    "expr_unknown_axis",
    "friction_column",
    "friction_of_crossover",
    "friction_with_law",
    "geomspace_from_zero",
    "geomspace_through_zero",
    "label_near_axis",
    "label_of_numbers",
    "label_taken",
    "label_too_long",
    "law_eps_of_optimal",
    "law_of_crossover",
    "law_of_gap_without_ceiling",
    "law_of_points",
    "law_of_reduced",
    "law_twice",
    "law_with_tau_ceiling",
    "law_without_ceiling",
    "law_without_floor",
    "lhs_descending",
    "lhs_two_seeds",
    "points_and_axis",
    "points_bad_cell",
    "points_column_twice",
    "points_empty_cell",
    "points_family",
    "points_header_quote",
    "points_not_parquet",
    "points_not_there",
    "points_out_of_range",
    "points_parquet_null",
    "points_parquet_out_of_range",
    "points_parquet_words",
    "points_quote_inside",
    "points_quote_over_cells",
    "points_ragged",
    "points_scale",
    "points_several_cells",
    "points_unclosed_quote",
    "points_unit_in_name",
    "points_unknown_column",
    "points_without_rows",
    "range_same_ends",
    "range_through_hole",
    "range_too_fine",
    "reduce_too_many",
    "reduce_where",
    "rows_overflow",
    "seed_alone",
    "si_out_of_range",
    "si_scaled_velocity",
    "si_underflow",
    "sobol_unequal",
    "theta_missing",
    "where_a_number",
    "where_ampersands",
    "where_arguments",
    "where_chained",
    "where_comment",
    "where_function",
    "where_huge",
    "where_keeps_nothing",
    "where_label",
    "where_label_alone",
    "where_label_typo",
    "where_law",
    "where_more",
    "where_number_as_word",
    "where_of_nan",
    "where_of_two_tables",
    "where_or_signs",
    "where_select",
    "where_shift",
    "where_syntax",
    "where_too_deep",
    "where_too_long",
    "where_two_operators",
    "where_two_stars",
    "where_unknown_axis",
    "where_word_as_number",
    "where_word_bare",
    "where_word_in_double_quotes",
    "where_word_unknown",
    "zip_of_a_sample",
    "zip_of_an_expr",
    "zip_of_points",
    "zip_twice",
    "zip_unequal",
}


def without_infinity(value):
    """As readers of TOML make JSON of it, which has neither infinities nor NaN."""
    if isinstance(value, dict):
        return {key: without_infinity(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [without_infinity(inner) for inner in value]
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value


def main():
    schema = json.loads(Path(sys.argv[1]).read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)

    def faults(path):
        spec = without_infinity(tomllib.loads(path.read_text()))
        return [f"{'.'.join(map(str, error.absolute_path))}: {error.message}" for error in validator.iter_errors(spec)]

    good = sorted((REPOSITORY / "sweeps").glob("**/*.toml")) + [Path(name) for name in sys.argv[2:]]
    assert len(good) >= 6
    for path in good:
        assert not faults(path), (path, faults(path))

    bad = {path.stem: path for path in sorted((REPOSITORY / "tests/bad_specs").glob("*.toml"))}
    assert ONLY_THE_CHECK <= bad.keys(), ONLY_THE_CHECK - bad.keys()
    wrong = []
    for name, path in bad.items():
        try:
            found = bool(faults(path))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError):
            found = True
        if found == (name in ONLY_THE_CHECK):
            wrong.append(name)
    assert not wrong, f"the schema judges these otherwise: {wrong}"
    print(f"schema: {len(good)} good specs, {len(bad) - len(ONLY_THE_CHECK)} bad ones caught of {len(bad)}")


main()
