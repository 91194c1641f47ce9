# bash completion for callboard
_callboard() {
    local current word kept="" line="${COMP_LINE:0:COMP_POINT}"
    current="${line##*[[:space:]]}"
    # readline takes : and = for ends of words, and completes only what follows them
    case "$current" in
        *[:=]*)
            word="${current##*[:=]}"
            kept="${current%"$word"}"
            [[ $kept == *:* && $COMP_WORDBREAKS != *:* ]] && kept=""
            [[ $kept == *=* && $COMP_WORDBREAKS != *=* ]] && kept=""
            ;;
    esac
    COMPREPLY=()
    while IFS= read -r word; do
        word="${word%%$'\t'*}"
        if [[ $word == :files: ]]; then
            compopt -o default 2>/dev/null
        else
            COMPREPLY+=("${word#"$kept"}")
        fi
    done < <(command "${COMP_WORDS[0]/#\~/$HOME}" completion bash --line "$line" 2>/dev/null)
}
complete -F _callboard callboard
