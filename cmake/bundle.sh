# bundle FOLDER PAPERS BINARY...: copies the libraries that the binaries need, and OSMesa, into FOLDER and their licences into
# PAPERS; the C library belongs to the system. Sourced by tarball.sh and wheel.sh.
bundle() {
  local libraries=$1 papers=$2
  shift 2
  mkdir -p "$libraries" "$papers"
  # OSMesa is opened while the program runs.
  local osmesa library package
  osmesa=$(ldconfig -p | sed -n 's/.*libOSMesa\.so\.8 .*=> //p' | sed -n 1p)
  {
    echo "$osmesa"
    ldd "$@" "$osmesa" | awk '$3 ~ "^/" {print $3}'
  } | sort -u | while read -r library; do
    # known by one of its two names: /lib is /usr/lib
    package=$({ dpkg-query -S "$library" "$(realpath "$library")" 2>/dev/null || true; } | sed -n '1s/:.*//p')
    if [ "$package" = libc6 ]; then continue; fi
    cp -L "$library" "$libraries"
    cp -L "/usr/share/doc/$package/copyright" "$papers/$package"
  done
  # shellcheck disable=SC2016  # the loader's $ORIGIN
  patchelf --set-rpath '$ORIGIN' "$libraries"/*
}
