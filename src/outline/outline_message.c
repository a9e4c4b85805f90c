/* The contours of a text between a reader and its caller. */
#include "base/try.h"
#include "outline/outline.h"
#include "sandbox/reader.h"

#include <string.h>

vsh_result vshi_serve_text(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    vsh_text_options options = vsh_text_options_default();
    const char *text = vshi_decode_text(request, false);
    options.height = vshi_decode_number(request);
    options.line_spacing = vshi_decode_number(request);
    options.align = (int32_t)vshi_decode_count(request, VSH_ALIGN_RIGHT);
    if (text == NULL || !vshi_decoder_ends(request)) {
        return vshi_fail(error, VSH_ERROR_INTERNAL, "%s: the request to its reader does not hold", path);
    }
    vshi_contours contours = {.run = run, .error = error};
    vsh_result result;
    VSHI_TRY_DONE(vshi_contours_draw(text, path, &options, run, &contours, error));
    VSHI_TRY_DONE(contours.result);
    vshi_encode_count(payload, contours.contour_count);
    for (size_t c = 0; c < contours.contour_count; ++c) {
        const size_t begin = contours.starts[c], count = contours.starts[c + 1] - begin;
        vshi_encode_count(payload, count);
        vshi_encode_array(payload, contours.points + begin, count, sizeof *contours.points);
    }
done:
    vshi_contours_free(&contours);
    return result;
}

/* Each point goes through the checks of one that was drawn here. */
vsh_result vshi_contours_decode(vshi_decoder *decoder, vshi_contours *contours, const char *path,
                                vsh_error *error) {
    const uint64_t count = vshi_decode_count(decoder, UINT32_MAX);
    for (uint64_t c = 0; c < count && !decoder->bad; ++c) {
        const uint64_t size = vshi_decode_count(decoder, UINT32_MAX);
        const vshi_point *points = vshi_decode_array(decoder, size, sizeof *points);
        for (uint64_t i = 0; points != NULL && i < size; ++i) {
            vshi_contours_add(contours, points[i].x, points[i].y);
        }
        vshi_contours_close(contours);
        VSHI_TRY(contours->result);
    }
    return vshi_decoder_ends(decoder) && contours->contour_count == count
               ? VSH_OK
               : vshi_answer_fail(path, "its contours", error);
}

vsh_result vshi_contours_from_reader(const char *text, const char *path, const vsh_text_options *options,
                                     const vsh_run *run, vshi_contours *contours, vsh_error *error) {
    enum { UNITS = 1000 };
    vshi_exchange exchange;
    vshi_answer answer;
    vshi_job *job = vshi_job_begin(run, "outline", UNITS);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_exchange_begin(&exchange, VSHI_READ_TEXT, path, run, error));
    vshi_encode_text(&exchange.encoder, text);
    vshi_encode_number(&exchange.encoder, options->height);
    vshi_encode_number(&exchange.encoder, options->line_spacing);
    vshi_encode_count(&exchange.encoder, (uint64_t)options->align);
    VSHI_TRY_DONE(vshi_exchange_send_job(&exchange, job, UNITS, &answer, error));
    result = vshi_contours_decode(&answer.payload, contours, path, error);
    vshi_answer_free(&answer);
done:
    vshi_job_end(job);
    return result;
}
