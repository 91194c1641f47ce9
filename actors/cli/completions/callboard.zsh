#compdef callboard
_callboard() {
    local -a offers
    local word about files=""
    while IFS=$'\t' read -r word about; do
        if [[ $word == :files: ]]; then
            files=yes
        else
            offers+=("${word//:/\\:}${about:+:$about}")
        fi
    done < <(command "${words[1]/#\~/$HOME}" completion zsh --words \
        "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)
    (( $#offers )) && _describe -t callboard callboard offers
    [[ -n $files ]] && _files
    return 0
}
if [[ ${funcstack[1]} == _callboard ]]; then
    _callboard "$@"
else
    compdef _callboard callboard
fi
