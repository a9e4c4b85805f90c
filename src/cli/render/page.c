/* A turntable in one page that needs nothing beside it. */
#include "cli/document.h"
#include "cli/message.h"
#include "cli/temporary.h"
#include "cli/try.h"
#include "render.h"

#include <math.h>
#include <stdlib.h>

struct render_page {
    const render_settings *settings;
    FILE *out;
    char *text;
    size_t size;
};

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" "
    "content=\"width=device-width,initial-scale=1\">\n<title>vdbshade</title>\n<style>\n"
    "body{margin:0;background:#222;color:#ddd;font:14px system-ui,sans-serif;text-align:center}\n"
    "img{max-width:100%;max-height:calc(100vh - 4em);cursor:grab;touch-action:pan-y;user-select:none}\n"
    "input{width:min(90%,40em);margin:1em 0}\n</style>\n"
    "<img id=\"view\" alt=\"the scene, from a camera that turns\" draggable=\"false\">\n"
    "<div><input id=\"turn\" type=\"range\" aria-label=\"angle\" min=\"0\" value=\"0\"></div>\n<script>\n"
    "const frames=[\n";

static const char tail[] =
    "].map(data=>{const i=new Image();i.src='data:image/png;base64,'+data;return i});\n"
    "const view=document.getElementById('view'),turn=document.getElementById('turn'),n=frames.length;\n"
    "turn.max=n-1;\n"
    "function show(k){k=((Math.round(k)%n)+n)%n;turn.value=k;view.src=frames[k].src}\n"
    "turn.oninput=()=>show(+turn.value);\n"
    "let from=null,start=0;\n"
    "view.onpointerdown=e=>{from=e.clientX;start=+turn.value;view.setPointerCapture(e.pointerId)};\n"
    "view.onpointermove=e=>{if(from!==null)show(start-(e.clientX-from)*n/view.clientWidth)};\n"
    "view.onpointerup=view.onpointercancel=()=>{from=null};\n"
    "show(0);\n</script>\n</html>\n";

render_page *render_page_begin(const render_settings *s) {
    render_page *page = calloc(1, sizeof *page);
    if (page == NULL) {
        return NULL;
    }
    page->settings = s;
    page->out = open_memstream(&page->text, &page->size);
    if (page->out == NULL) {
        free(page);
        return NULL;
    }
    fputs(head, page->out);
    return page;
}

int render_page_add(render_page *page, const render_picture *picture) {
    const render_settings *s = page->settings;
    const int32_t channels = s->transparent ? 4 : 3;
    const size_t count = (size_t)s->width * (size_t)s->height;
    uint8_t *values = malloc(count * (size_t)channels);
    if (values == NULL) {
        return cli_out_of_memory("page");
    }
    int code;
    CLI_TRY_DONE(render_output_encode(s, picture));
    for (size_t i = 0; i < count; ++i) {
        for (size_t c = 0; c < (size_t)channels; ++c) {
            values[i * (size_t)channels + c] = (uint8_t)lroundf(255.0f * picture->encoded[c][i]);
        }
    }
    const cli_pixels pixels = {s->width, s->height, channels, values};
    fputc('"', page->out);
    CLI_TRY_DONE(cli_document_png(page->out, s->bake.output, &pixels));
    fputs("\",\n", page->out);
    if (ferror(page->out)) {
        code = cli_out_of_memory("page");
    }
done:
    free(values);
    return code;
}

void render_page_abandon(render_page *page) {
    if (page != NULL) {
        if (page->out != NULL) {
            fclose(page->out);
        }
        free(page->text);
        free(page);
    }
}

int render_page_end(render_page *page) {
    fputs(tail, page->out);
    const bool whole = !ferror(page->out) && fclose(page->out) == 0;
    page->out = NULL;
    const int code =
        whole ? cli_temporary_write(page->settings->bake.output, page->text) : cli_out_of_memory("page");
    render_page_abandon(page);
    return code;
}
