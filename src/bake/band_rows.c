/* Which rows of texels a band holds. */
#include "bake/nearest_valid.h"
#include "bake/texels.h"

enum { LEAST_BESIDE = VSHI_SPREAD_REACH }; /* texels beside a band: invalid ones may be filled from as far */

/* Beside a part that shoots for its own texels alone are the rest of the squares that its ends divide, and a
 * row of tiles behind them, which tells where charts end. What is held begins with a square all the same. */
static void set_cut(const vshi_ao_cut *cut, vshi_band *band) {
    const size_t square = (size_t)cut->spacing;
    const size_t first = (size_t)vshi_ao_cut_begin(cut) / square * square;
    const size_t end = ((size_t)vshi_ao_cut_end(cut) + square - 1) / square * square + 1;
    if (first > band->held_begin) {
        band->held_begin = first - square;
        band->laid_begin = first - 1 > band->laid_begin ? first - 1 : band->laid_begin;
    }
    band->held_end = end < band->held_end ? end : band->held_end;
    band->laid_end = band->held_end;
}

vsh_result vshi_band_set(const vsh_charts *charts, int32_t first_row, int32_t rows, const vshi_ao_cut *cut,
                         vshi_band *band, vsh_error *error) {
    const int32_t height = charts->info.height;
    if (first_row < 0 || first_row >= height || first_row % VSH_BAND_STEP != 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "band from row %d: expected a multiple of %d below %d",
                         first_row, VSH_BAND_STEP, height);
    }
    if (rows < 1 || rows > height - first_row || (rows % VSH_BAND_STEP != 0 && rows != height - first_row)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "band of %d rows from row %d: expected a multiple of %d, or the %d that are left",
                         rows, first_row, VSH_BAND_STEP, height - first_row);
    }
    const size_t tile = VSHI_TILE, all = charts->sorted.rows;
    const size_t reach = (size_t)(charts->padding > LEAST_BESIDE ? charts->padding : LEAST_BESIDE);
    const size_t beside = cut != NULL ? 0 : (reach + tile - 1) / tile;
    band->own_first = first_row;
    band->own_rows = rows;
    band->own_begin = (size_t)first_row / tile;
    band->own_end = ((size_t)first_row + (size_t)rows + tile - 1) / tile;
    band->held_begin = band->own_begin > beside ? band->own_begin - beside : 0;
    band->held_end = all - band->own_end > beside ? band->own_end + beside : all;
    if (charts->ao_spacing > 1) {
        vshi_ao_rows(charts->ao_spacing, all, &band->held_begin, &band->held_end);
    }
    band->laid_begin = band->held_begin;
    band->laid_end = band->held_end;
    if (cut != NULL && cut->spacing > 1) {
        set_cut(cut, band);
    }
    band->first = (int32_t)(band->held_begin * tile);
    band->rows = (band->held_end == all ? height : (int32_t)(band->held_end * tile)) - band->first;
    return VSH_OK;
}
