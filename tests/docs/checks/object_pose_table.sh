# The page shows what the program prints, up to the digits.
words() { sed -E 's/-?[0-9]+(\.[0-9]+)?/N/g; s/ +/ /g; s/ $//' "$1"; }
diff <(words "$BLOCKS_DIR/mixtures_text_1.text") <(words block.out)
