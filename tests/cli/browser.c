/* A page in Chromium without a window, by its debugging pipe: waits until the page says that it is ready or
 * has failed (data-state of its root), does what is asked, and keeps its picture and document. Usage:
 *
 *   browser URL SIZE OUT.png OUT.html [key:NAME | click:X,Y | drag:X,Y,X,Y | value:ID=TEXT |
 *   tell:EXPRESSION]… [-- CHROMIUM_OPTION …]
 *
 * SIZE is a number, or WIDTHxHEIGHT; with an m behind it the page is on a phone with a touch screen. `tell`
 * prints what an expression comes to, a line each. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <jansson.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { MOST_OPTIONS = 64, ANSWER_MS = 120000, READY_SECONDS = 120 };

static struct {
    pid_t chromium;
    int to, from;
    char *buffer; /* what has come and is not yet a whole message */
    size_t used, room;
    int calls;
    char *session;
} state;

static void stop(const char *why) {
    fprintf(stderr, "browser: %s\n", why);
    if (state.chromium > 0) {
        kill(-state.chromium, SIGKILL);
    }
    exit(1);
}

static void start(char **more) {
    char *options[MOST_OPTIONS] = {"chromium",
                                   "--headless",
                                   "--no-sandbox",
                                   "--no-first-run",
                                   "--disable-extensions",
                                   "--disable-background-networking",
                                   "--hide-scrollbars",
                                   "--remote-debugging-pipe",
                                   "--use-angle=swiftshader",
                                   "--enable-unsafe-swiftshader"};
    size_t count = 10;
    for (; *more != NULL && count < MOST_OPTIONS - 1; ++more) {
        options[count++] = *more;
    }
    int to[2], from[2];
    if (pipe2(to, O_CLOEXEC) != 0 || pipe2(from, O_CLOEXEC) != 0) {
        stop("no pipes");
    }
    state.chromium = fork();
    if (state.chromium == 0) {
        setpgid(0, 0);
        const int in = fcntl(to[0], F_DUPFD, 10), out = fcntl(from[1], F_DUPFD, 10);
        dup2(in, 3);
        dup2(out, 4);
        close(in);
        close(out);
        execvp(options[0], options);
        _exit(127);
    }
    setpgid(state.chromium, state.chromium);
    close(to[0]);
    close(from[1]);
    state.to = to[1];
    state.from = from[0];
}

/* The next message; they end in NUL. */
static json_t *receive(void) {
    for (;;) {
        char *end = state.used > 0 ? memchr(state.buffer, '\0', state.used) : NULL;
        if (end != NULL) {
            json_t *message = json_loads(state.buffer, 0, NULL);
            const size_t length = (size_t)(end - state.buffer) + 1;
            memmove(state.buffer, state.buffer + length, state.used - length);
            state.used -= length;
            return message;
        }
        if (state.room - state.used < 65536) {
            state.room = 2 * state.room + 131072;
            state.buffer = realloc(state.buffer, state.room);
        }
        struct pollfd wait = {state.from, POLLIN, 0};
        const ssize_t now = state.buffer != NULL && poll(&wait, 1, ANSWER_MS) == 1
                                ? read(state.from, state.buffer + state.used, state.room - state.used)
                                : -1;
        if (now <= 0) {
            stop("chromium does not answer");
        }
        state.used += (size_t)now;
    }
}

/* The result of a call, which takes over its parameters. */
static json_t *call(const char *method, json_t *parameters) {
    const int id = ++state.calls;
    json_t *message = json_pack("{s:i,s:s,s:o}", "id", id, "method", method, "params", parameters);
    if (state.session != NULL) {
        json_object_set_new(message, "sessionId", json_string(state.session));
    }
    char *text = json_dumps(message, JSON_COMPACT);
    const size_t length = strlen(text) + 1;
    if (write(state.to, text, length) != (ssize_t)length) {
        stop("chromium takes nothing");
    }
    free(text);
    json_decref(message);
    for (;;) {
        json_t *answer = receive();
        if (json_integer_value(json_object_get(answer, "id")) == id) {
            if (json_object_get(answer, "error") != NULL) {
                stop(json_dumps(answer, 0));
            }
            json_t *result = json_incref(json_object_get(answer, "result"));
            json_decref(answer);
            return result;
        }
        json_decref(answer);
    }
}

/* A string that an expression comes to, to be freed; of a promise, what it comes to. */
static char *evaluate(const char *expression) {
    json_t *result = call("Runtime.evaluate", json_pack("{s:s,s:b,s:b}", "expression", expression,
                                                        "awaitPromise", 1, "returnByValue", 1));
    const char *text = json_string_value(json_object_get(json_object_get(result, "result"), "value"));
    char *copy = strdup(text != NULL ? text : "");
    json_decref(result);
    return copy;
}

static void wait_until_ready(void) {
    const time_t end = time(NULL) + READY_SECONDS;
    for (;;) {
        char *now = evaluate("document.documentElement.dataset.state || ''");
        const bool done = strcmp(now, "ready") == 0 || strcmp(now, "failed") == 0;
        free(now);
        if (done) {
            return;
        }
        if (time(NULL) > end) {
            stop("the page is never ready");
        }
        nanosleep(&(struct timespec){0, 20000000}, NULL);
    }
}

static void mouse(const char *type, double x, double y, int buttons) {
    json_decref(call("Input.dispatchMouseEvent",
                     json_pack("{s:s,s:f,s:f,s:s,s:i,s:i}", "type", type, "x", x, "y", y, "button",
                               strcmp(type, "mouseMoved") == 0 ? "none" : "left", "buttons", buttons,
                               "clickCount", 1)));
}

/* Sets what a field holds, as a user's choice of it does. */
static void choose(const char *id, const char *value) {
    char script[512];
    snprintf(script, sizeof script,
             "{ const field = document.getElementById('%s'); field.value = '%s';"
             " field.dispatchEvent(new Event('input')); field.dispatchEvent(new Event('change')); } ''",
             id, value);
    free(evaluate(script));
}

static void act(const char *action) {
    double a[4];
    char id[64], value[64];
    if (sscanf(action, "click:%lf,%lf", a, a + 1) == 2) {
        mouse("mousePressed", a[0], a[1], 1);
        mouse("mouseReleased", a[0], a[1], 0);
    } else if (sscanf(action, "drag:%lf,%lf,%lf,%lf", a, a + 1, a + 2, a + 3) == 4) {
        mouse("mouseMoved", a[0], a[1], 0);
        mouse("mousePressed", a[0], a[1], 1);
        mouse("mouseMoved", (a[0] + a[2]) / 2, (a[1] + a[3]) / 2, 1);
        mouse("mouseMoved", a[2], a[3], 1);
        mouse("mouseReleased", a[2], a[3], 0);
    } else if (strncmp(action, "key:", 4) == 0) {
        const char *key = action + 4, *text = strcmp(key, "Enter") == 0 ? "\r" : strlen(key) == 1 ? key : "";
        json_decref(call("Input.dispatchKeyEvent",
                         json_pack("{s:s,s:s,s:s}", "type", "keyDown", "key", key, "text", text)));
        json_decref(call("Input.dispatchKeyEvent", json_pack("{s:s,s:s}", "type", "keyUp", "key", key)));
    } else if (sscanf(action, "value:%63[^=]=%63s", id, value) == 2) {
        choose(id, value);
    } else if (strncmp(action, "tell:", 5) == 0) {
        char *told = evaluate(action + 5);
        puts(told);
        free(told);
    } else {
        stop(action);
    }
}

static void set_size(const char *size) {
    int width = 0, height = 0;
    char end = '\0';
    const int read = sscanf(size, "%dx%d%c", &width, &height, &end);
    const bool phone = read == 3 && end == 'm';
    json_decref(call("Emulation.setDeviceMetricsOverride",
                     json_pack("{s:i,s:i,s:i,s:b}", "width", width, "height", read > 1 ? height : width,
                               "deviceScaleFactor", 1, "mobile", phone)));
    json_decref(call("Emulation.setTouchEmulationEnabled", json_pack("{s:b}", "enabled", phone)));
}

static void save(const char *path, const char *text, bool base64) {
    FILE *out = fopen(path, "wb");
    if (out == NULL) {
        stop(path);
    }
    unsigned word = 0;
    int bits = 0;
    static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (const char *at = text; *at != '\0'; ++at) {
        const char *found = base64 ? strchr(alphabet, *at) : NULL;
        if (!base64) {
            fputc(*at, out);
        } else if (found != NULL) {
            word = word << 6 | (unsigned)(found - alphabet);
            bits += 6;
            if (bits >= 8) {
                bits -= 8;
                fputc((int)(word >> bits & 255u), out);
            }
        }
    }
    if (fclose(out) != 0) {
        stop(path);
    }
}

int main(int argc, char **argv) {
    if (argc < 5) {
        stop("URL SIZE OUT.png OUT.html [ACTION]… [-- CHROMIUM_OPTION …]");
    }
    signal(SIGPIPE, SIG_IGN);
    int options = 5;
    while (options < argc && strcmp(argv[options], "--") != 0) {
        ++options;
    }
    start(argv + options + (options < argc));
    json_t *target = call("Target.createTarget", json_pack("{s:s}", "url", "about:blank"));
    json_t *attached =
        call("Target.attachToTarget",
             json_pack("{s:O,s:b}", "targetId", json_object_get(target, "targetId"), "flatten", 1));
    state.session = strdup(json_string_value(json_object_get(attached, "sessionId")));
    json_decref(target);
    json_decref(attached);
    set_size(argv[2]);
    json_decref(call("Page.navigate", json_pack("{s:s}", "url", argv[1])));
    wait_until_ready();
    static const char drawn[] = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => "
                                "setTimeout(r, 0)))).then(() => '')";
    for (int i = 5; i < options; ++i) {
        act(argv[i]);
        free(evaluate(drawn));
    }
    free(evaluate(drawn));
    json_t *picture = call("Page.captureScreenshot", json_object());
    save(argv[3], json_string_value(json_object_get(picture, "data")), true);
    json_decref(picture);
    char *text = evaluate(
        "document.querySelectorAll('script').forEach(s => s.remove()), document.documentElement.outerHTML");
    save(argv[4], text, false);
    free(text);
    free(state.session);
    state.session = NULL;
    json_decref(call("Browser.close", json_object()));
    free(state.buffer);
    waitpid(state.chromium, NULL, 0);
    return 0;
}
