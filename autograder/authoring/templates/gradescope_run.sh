#!/usr/bin/env bash
# Gradescope runs this for each submission, in /autograder.
# Programs run in the strongest isolation that the container allows. If it allows neither of these, there is no result,
# and Gradescope shows the reason to the instructor. If you add `none`, submissions can read and write everything here.
ISOLATIONS="full reduced"
LAB="@LAB@"
HERE=${AUTOGRADER_FOLDER:-/autograder}

say() { printf '{"score": 0, "output": "%s"}\n' "$1" >"$HERE/results/results.json"; }

mkdir -p "$HERE/results"
notebook="$HERE/submission/$LAB.ipynb"
if [ ! -f "$notebook" ]; then
    mapfile -d '' found < <(find "$HERE/submission" -type f -name '*.ipynb' -not -path '*/.*' -print0)
    if [ "${#found[@]}" -ne 1 ]; then
        say "Nothing was checked: hand in one notebook, $LAB.ipynb. Your submission contains ${#found[@]} notebooks."
        exit 0
    fi
    notebook=${found[0]}
fi
for isolation in $ISOLATIONS; do
    "$HERE/source/kit/.venv/bin/autograder" check "$notebook" --lab "$LAB" --course "$HERE/source/course" \
        --isolation "$isolation" --gradescope "$HERE/results/results.json" && break
    [ -f "$HERE/results/results.json" ] && break
done
[ -f "$HERE/results/results.json" ]
