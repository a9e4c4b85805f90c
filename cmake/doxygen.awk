# Rewrites a public header for Doxygen. The first comment describes the file. A comment behind a line of members describes all of
# them. A function without a comment shares that of the function above.
NR == 1 && /^\/\* / {
    sub(/\/\* /, "/** @file\n * ")
    print
    next
}

# Members that share the comment above them: those after "these four as in …", the upper corner of a box, the height after a width,
# the count of an array whose comment names it in brackets.
function understood(name) {
    if (covered > 0) return --covered >= 0
    return (name ~ /max$/ && above ~ /min$/) || (name == "height" && above == "width") || \
           (name ~ /count$/ && index(said, "[" name "]") > 0)
}
/^typedef struct / { said = "" }
{ said = said $0 }
/^[ \t]+[A-Za-z_][A-Za-z_0-9 *]*[ *]+[a-z_0-9]+(\[[^]]*\])*;/ && !in_function {
    name = $0
    sub(/(\[[^]]*\])*;.*/, "", name)
    sub(/.*[ *]/, "", name)
    at = index($0, "/* ")
    if (at > 0) {
        above_text = substr($0, at)
        covered = above_text ~ /these two/ ? 1 : above_text ~ /these three/ ? 2 : above_text ~ /these four/ ? 3 : above_text ~ /these five/ ? 4 : 0
    } else if (!under_comment && $0 ~ /;[ \t]*$/ && understood(name)) {
        $0 = $0 " /**< Told with " above_name ". */"
        above = name
        print
        next
    }
    if (at > 0 || under_comment) above_name = name
    above = name
    under_comment = 0
}
in_struct_comment { above_text = above_text $0 }
/^[ \t]+\/\* / { under_comment = 1; above_text = "" }
/^[ \t]+\/\* / || /;[ \t]*\/\* / { in_struct_comment = 1 }
/\*\// { in_struct_comment = 0 }

# members of one line, before a comment that may continue on the next lines
members != "" {
    text = $0
    sub(/^[ \t]*\*?[ \t]*/, "", text)
    comment = comment " " text
    ++lines
    if ($0 ~ /\*\//) write_members()
    next
}

function write_members(    names, count, i, type, out) {
    sub(/[ \t]*\*\/.*/, "", comment)
    sub(/;.*/, "", members)
    sub(/^[ \t]+/, "", members)
    count = split(members, names, /,[ \t]*/)
    type = names[1]
    sub(/[ \t]*\**[A-Za-z_0-9]+(\[[^]]*\])*$/, "", type)
    names[1] = substr(names[1], length(type) + 1)
    for (i = 1; i <= count; ++i) out = out type " " names[i] "; /**< " comment " */ "
    for (i = 0; i < lines; ++i) out = out "\n"
    print out
    members = ""
    lines = 0
}

/^[ \t]+[a-z][A-Za-z_0-9 ]*[ *]+[a-z_0-9]+(\[[^]]*\])*,[^;(]*;[ \t]*\/\* / {
    members = $0
    comment = substr($0, index($0, "/* ") + 3)
    sub(/[ \t]*\/\* .*/, "", members)
    if (comment ~ /\*\//) write_members()
    next
}

/^[ \t]*size_t struct_size;[ \t]*$/ {
    print "    size_t struct_size; /**< sizeof the struct as the caller's header has it, set by …_default() */"
    next
}

# functions
/^(VSH_API|static inline) / {
    if (!told && /vsh_[a-z_]+_default\(void\)/) printf "/** One with the defaults that its members tell. */ "
    else if (!told && /vsh_[a-z_]+_zero\(void\)/) printf "/** One of zeros, with its size. */ "
    else if (!told && first != "") printf "/** Told with %s(). */ ", first
    else if (match($0, /vsh_[a-z0-9_]+\(/)) first = substr($0, RSTART, RLENGTH - 1)
    told = 1
    in_function = $0 !~ /(;|})[ \t]*(\/\*.*)?$/
    if ($0 ~ /;[ \t]*\/\* /) sub(/\/\* /, "/**< ")
    else if (!in_function) told = 0
    print
    if (!in_function) told = 0
    next
}
in_function {
    in_function = $0 !~ /;[ \t]*(\/\*.*)?$/ && $0 !~ /^}/
    if (/{[ \t]*$/) in_body = 1
    if (in_body) in_function = $0 !~ /^}/
    if (!in_function) { told = 0; in_body = 0; sub(/;[ \t]*\/\* /, "; /**< ") }
    print
    next
}

# macros: a comment describes successive macros, and one in an #if below it
/^#define VSH_/ && macro_text != "" { print "/** " macro_text " */ " $0; next }
/^\/\* .*\*\/[ \t]*$/ { macro_text = $0; gsub(/^\/\* | *\*\/[ \t]*$/, "", macro_text) }
!/^#/ && !/^\/\* / { macro_text = "" }

/^[ \t]*$/ { first = ""; told = 0 }
/^\/\* / { told = 1; in_comment = 1; first = "" }
in_comment || /^[ \t]*\/\* / { if (/\*\//) in_comment = 0 }
/^[ \t]*\/\* / { sub(/\/\* /, "/** ") }
/[^ \t\/].*\/\* / && !/^#/ && !/\/\*\*/ { at = index($0, "/* "); $0 = substr($0, 1, at - 1) "/**< " substr($0, at + 3) }
{ print }
