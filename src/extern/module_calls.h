/* The calls of a module: listed once, as MAKE(name, parameters, arguments, none), GIVE(result, name,
 * parameters, arguments) and DO(name, parameters, arguments), they are the members of its table, what the
 * module puts there, and the functions by which the library passes them on.
 *
 * MAKE returns a vsh_result and loads the module; its last parameter is `vsh_error *error`, and `none` points
 * to what is set to 0 where the module cannot be had, or is NULL. GIVE is about what those have made. DO
 * returns nothing, and does nothing where there is no module yet, and so nothing to free. */
#ifndef VSHI_MODULE_CALLS_H
#define VSHI_MODULE_CALLS_H

/* Members of the table. */
#define VSHI_MEMBER_MAKE(name, parameters, arguments, none) vsh_result(*name) parameters;
#define VSHI_MEMBER_GIVE(result, name, parameters, arguments) result(*name) parameters;
#define VSHI_MEMBER_DO(name, parameters, arguments) void(*name) parameters;

/* Their values in the module. */
#define VSHI_VALUE_MAKE(name, parameters, arguments, none) name,
#define VSHI_VALUE_GIVE(result, name, parameters, arguments) name,
#define VSHI_VALUE_DO(name, parameters, arguments) name,

/* The library's functions, in a file that has the vshi_module `module`, and its table by at(). */
#define VSHI_PASS_MAKE(name, parameters, arguments, none)                                                    \
    vsh_result name parameters {                                                                             \
        const vsh_result result = vshi_module_load(&module, error);                                          \
        if (result == VSH_OK) {                                                                              \
            return at()->name arguments;                                                                     \
        }                                                                                                    \
        if ((none) != NULL) {                                                                                \
            *(none) = 0;                                                                                     \
        }                                                                                                    \
        return result;                                                                                       \
    }
#define VSHI_PASS_GIVE(result, name, parameters, arguments)                                                  \
    result name parameters {                                                                                 \
        return at()->name arguments;                                                                         \
    }
#define VSHI_PASS_DO(name, parameters, arguments)                                                            \
    void name parameters {                                                                                   \
        if (at() != NULL) {                                                                                  \
            at()->name arguments;                                                                            \
        }                                                                                                    \
    }

#endif
