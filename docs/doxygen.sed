# What Doxygen reads instead of the sources; see INPUT_FILTER in docs/Doxyfile.

# The dot of an abbreviation does not end the brief description.
/\/\/\/<? [^ ]/ s/\b(Eqs?|eqs?|sec|Alg)\.( |$)/\1.\\ /g

# The links of docs/api.md lead to the pages of headers and, from build/docs/html, to other documents.
s/\[`([^]`]*)`\]\(\.\.\/(include|examples)\/([^)]*\.hpp)\)/@ref \3 "\1"/g
s/\[([^]]*)\]\(([a-z_]+\/)?([a-z_]+\.md)\)/<a href="..\/..\/..\/docs\/\2\3">\1<\/a>/g
